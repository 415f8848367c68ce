"""Tables of the benchmark of nets: one line per mesh, one per method, and how they compare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import geometric_mean, median

from planner.blooming_trees import BLOOMING_TREES

TRIED_MANY = ("steepest-random", "flat-tree", "unflat-tree", "random")
"""Methods that take the best of many trees: the table of meshes has one column for each."""


@dataclass(frozen=True)
class Run:
    """One method on one mesh with one seed.

    Attributes:
        mesh: name of the mesh.
        faces: its faces.
        base: the base face.
        method: name of the method, ``exact`` for the proof.
        seed: of the random choices.
        is_net: nothing overlaps and the base can be held.
        overlaps: pairs of faces that overlap.
        edits: creases that the blooming tree of the result does not have.
        tree: that tree.
        seconds: of processor time.
        bound: proven lower bound of the edits; None without a proof.
        work: faces that were tested for overlap on the way.
    """

    mesh: str
    faces: int
    base: int
    method: str
    seed: int
    is_net: bool
    overlaps: int
    edits: int
    tree: str
    seconds: float
    bound: int | None
    work: int


def overlaps_of_trees(runs: Sequence[Run]) -> str:
    """Overlaps of the blooming trees, e.g. ``12 / 3 / 8``."""
    found = {run.method: str(run.overlaps) for run in runs if run.method in BLOOMING_TREES}
    return " / ".join(found.get(tree, "–") for tree in BLOOMING_TREES)


def cell(runs: Sequence[Run], method: str) -> list[str]:
    """Columns of one method: nets of runs, overlaps left where there is none, edits, seconds; medians."""
    own = [run for run in runs if run.method == method]
    if not own:
        return ["–", "–", "–"]
    nets = [run for run in own if run.is_net]
    result = f"{len(nets)}/{len(own)}"
    if len(nets) < len(own):
        result += f" ({median(run.overlaps for run in own if not run.is_net):g})"
    edits = f"{median(run.edits for run in nets):g}" if nets else "–"
    return [result, edits, seconds_text(median(run.seconds for run in own))]


def seconds_text(seconds: float) -> str:
    """Seconds with two digits that mean something."""
    return f"{seconds:.0f}" if seconds >= 9.5 else f"{seconds:.1f}" if seconds >= 0.95 else f"{seconds:.2g}"


def mesh_table(runs: Sequence[Run]) -> list[str]:
    """One line per mesh."""
    names = ["mesh", "faces", "overlaps S / D / B", "nb nets", "nb edits", "nb s", "fewest edits", "proof s"]
    names += ["ga nets", "ga edits", "ga s", *TRIED_MANY]
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    for name in dict.fromkeys(run.mesh for run in runs):
        own = [run for run in runs if run.mesh == name]
        proofs = [run.seconds for run in own if run.method == "exact"]
        row = [name, str(own[0].faces), overlaps_of_trees(own), *cell(own, "nb"), proof_text(own)]
        row += [seconds_text(sum(proofs)) if proofs else "–", *cell(own, "ga")]
        row += [cell(own, method)[0] for method in TRIED_MANY]
        lines.append("| " + " | ".join(row) + " |")
    return lines


def proof_text(runs: Sequence[Run]) -> str:
    """Fewest edits as proven: ``S 5`` where the bound is met, else ``S 5 to 7``; ``S 5 to ?`` without a net.

    A bound of as many edits as there are faces says that there is no net
    with this base: trees have fewer creases.
    """
    parts = []
    for run in runs:
        if run.method == "exact" and run.bound is not None:
            text = f"{run.bound} to {run.edits if run.is_net else '?'}"
            if run.is_net and run.edits == run.bound:
                text = str(run.edits)
            elif run.bound >= run.faces:
                text = "none"
            parts.append(f"{run.tree[0].upper()} {text}")
    return ", ".join(parts) or "–"


def method_table(runs: Sequence[Run]) -> list[str]:
    """One line per method over all meshes; the median of seconds is over meshes, each with its own median."""
    names = ["method", "meshes", "runs with a net", "meshes with a net in every run", "median s", "longest s"]
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    for method in dict.fromkeys(run.method for run in runs):
        own = [run for run in runs if run.method == method]
        meshes = list(dict.fromkeys(run.mesh for run in own))
        nets = sum(run.is_net for run in own)
        always = sum(all(run.is_net for run in own if run.mesh == mesh) for mesh in meshes)
        typical = [median(run.seconds for run in own if run.mesh == mesh) for mesh in meshes]
        row = [method, str(len(meshes)), f"{nets} of {len(own)} ({100 * nets / len(own):.0f} %)", str(always)]
        row += [seconds_text(median(typical)), seconds_text(max(run.seconds for run in own))]
        lines.append("| " + " | ".join(row) + " |")
    return lines


def ratio_lines(runs: Sequence[Run]) -> list[str]:
    """How nearly-blooming compares with the genetic algorithm and with the proof, in words."""
    pairs = []
    for mesh in dict.fromkeys(run.mesh for run in runs):
        nb, ga = ([r for r in runs if r.mesh == mesh and r.method == method] for method in ("nb", "ga"))
        if nb and ga and all(run.is_net for run in nb + ga):
            pairs.append((nb, ga))
    lines = []
    for least in (0, 100):
        part = [(nb, ga) for nb, ga in pairs if nb[0].faces >= least]
        if part:
            seconds = [(median(r.seconds for r in nb), median(r.seconds for r in ga)) for nb, ga in part]
            edits = [(median(r.edits for r in nb), median(r.edits for r in ga)) for nb, ga in part]
            words = f" of at least {least} faces" if least else ""
            lines.append(
                f"{len(part)} meshes{words} where every run of nb and ga finds a net: time nb : ga = "
                f"{geometric_mean(nb / ga for nb, ga in seconds):.2g} (geometric mean), nb is faster on "
                f"{sum(nb < ga for nb, ga in seconds)}; fewer edits with nb on "
                f"{sum(nb < ga for nb, ga in edits)}, with ga on {sum(ga < nb for nb, ga in edits)}"
            )
    return [*lines, *proof_lines(runs)]


def proof_lines(runs: Sequence[Run]) -> list[str]:
    """How many bounds were met, and how far nearly-blooming is from the best net known, in words."""
    exact = [run for run in runs if run.method == "exact"]
    if not exact:
        return []
    gaps = [run.edits - (run.bound or 0) for run in exact if run.is_net]
    none = sum((run.bound or 0) >= run.faces for run in exact)
    lines = [
        f"fewest edits proven for {gaps.count(0)} of {len(exact)} trees, widest gap "
        f"{max(gaps, default='–')}; proven that there is no net for {none}, neither net nor proof for "
        f"{len(exact) - len(gaps) - none}"
    ]
    beyond = []
    for run in exact:
        edits = [
            r.edits for r in runs if (r.mesh, r.method, r.tree) == (run.mesh, "nb", run.tree) and r.is_net
        ]
        if edits and run.is_net:
            beyond.append(median(edits) - run.edits)
    if beyond:
        lines.append(
            f"edits of nb beyond the best net known for the same tree: median {median(beyond):g}, most "
            f"{max(beyond):g}, none on {sum(more <= 0 for more in beyond)} of {len(beyond)}"
        )
    return lines
