"""Nets compared in one run: nearly-blooming, proven fewest edits, the genetic algorithm and plain trees.

``python -m benchmarks.nets --prove --csv out/nets.csv``

All methods get the same goal and the same base face, the best of ``rank_bases``, and one test of overlap
judges them all. Seconds are of processor time, after the kernels have been compiled; only ratios within one
run mean much. A budget counts work, nominal seconds; the proof has a limit in seconds of wall time.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from pathlib import Path

from benchmarks.corpus import mesh_kind
from benchmarks.net_tables import Run, mesh_table, method_table, ratio_lines
from models.goals import goal_path
from planner import DualGraph, NetError, rank_bases, read_goal
from planner.blooming_trees import BLOOMING_TREES, TreeName
from planner.fewest_edits import prove_net
from planner.nearly_blooming import NetAttempt
from planner.net_methods import NET_METHODS
from planner.overlap import overlapping_triangles

METHODS = ("nb", "ga", "steepest-random", "flat-tree", "unflat-tree", "random", *BLOOMING_TREES)
"""Methods in the order of the table; the blooming trees as they are come last."""

SEEDED = frozenset(METHODS) - frozenset(BLOOMING_TREES)
"""Methods whose result depends on the seed."""


def timed(make: Callable[[], NetAttempt]) -> tuple[NetAttempt, float]:
    """An attempt, and the processor time that it took."""
    start = time.process_time()
    attempt = make()
    return attempt, time.process_time() - start


def run_of(
    name: str, method: str, seed: int, attempt: NetAttempt, seconds: float, bound: int | None = None
) -> Run:
    """The figures of an attempt; what overlaps is looked at once more."""
    layout = attempt.layout
    overlaps = len(overlapping_triangles(layout.corners))
    if (overlaps == 0 and layout.free_edges() > 0) != attempt.is_net:
        raise SystemExit(f"{name}: method {method!r} claims a net that is none")
    return Run(
        mesh=name,
        faces=len(layout.graph.goal.faces),
        base=layout.base,
        method=method,
        seed=seed,
        is_net=attempt.is_net,
        overlaps=overlaps,
        edits=attempt.edits,
        tree=attempt.tree,
        seconds=seconds,
        bound=bound,
        work=attempt.work,
    )


def run_mesh(path: Path, options: argparse.Namespace) -> list[Run]:
    """All methods on one mesh."""
    graph = DualGraph(read_goal(path))
    base = rank_bases(graph, 1)[0].face
    runs = []
    for method in options.methods:
        for seed in range(options.seeds if method in SEEDED else 1):
            attempt, seconds = timed(
                lambda method=method, seed=seed: NET_METHODS[method](graph, base, seed, options.seconds)
            )
            runs.append(run_of(path.stem, method, seed, attempt, seconds))
    if options.prove:
        trees: Sequence[TreeName] = BLOOMING_TREES if options.all_trees else (_tree_of(runs),)
        for tree in trees:
            start = time.process_time()
            proven = prove_net(graph, base, tree=tree, seconds=options.prove_seconds)
            seconds = time.process_time() - start
            runs.append(run_of(path.stem, "exact", 0, proven.attempt, seconds, proven.lower_bound))
    return runs


def _tree_of(runs: Sequence[Run]) -> TreeName:
    """The blooming tree from which nearly-blooming came to its first net; the first tree without one."""
    for run in runs:
        for tree in BLOOMING_TREES:
            if run.method == "nb" and run.tree == tree:
                return tree
    return BLOOMING_TREES[0]


def warm_up() -> None:
    """Run everything once on a small goal, so that nothing is compiled while the clock runs."""
    graph = DualGraph(read_goal(goal_path("box_with_lid")))
    for method in METHODS:
        NET_METHODS[method](graph, 0, 0, 0.01)
    prove_net(graph, 0, seconds=5.0)


def write_csv(runs: Sequence[Run], path: Path) -> None:
    """One line per run."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Run)])
        writer.writeheader()
        writer.writerows(asdict(run) for run in runs)


def options_from(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Parse the command line."""
    shared = Path(__file__).resolve().parent.parent.parent / "shared" / "meshes"
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    add = parser.add_argument
    add("--meshes", type=Path, nargs="+", default=[shared / "proc", shared / "real"], metavar="DIR")
    add("--only", nargs="*", default=[], metavar="NAME", help="only these meshes, whatever their size")
    add("--max-faces", type=int, default=150, metavar="N")
    add("--also", nargs="*", default=["bunny-348"], metavar="NAME", help="larger meshes to add")
    add("--methods", nargs="+", default=list(METHODS), choices=METHODS, metavar="METHOD")
    add("--seeds", type=int, default=3, metavar="N", help="seeds 0 to N - 1")
    add("--seconds", type=float, default=20.0, help="nominal budget of one run")
    add("--prove", action="store_true", help="prove the fewest edits for the tree that nb came from")
    add("--all-trees", action="store_true", help="prove them for all three blooming trees")
    add("--prove-seconds", type=float, default=30.0, help="limit of one proof, wall time")
    add("--csv", type=Path, default=None, metavar="FILE")
    return parser.parse_args(arguments)


def find_meshes(options: argparse.Namespace) -> list[Path]:
    """Closed meshes of the folders, small ones first."""
    found = []
    for path in (path for folder in options.meshes for path in sorted(folder.glob("*.obj"))):
        kind, faces = mesh_kind(path)
        wanted = path.stem in options.only if options.only else faces <= options.max_faces
        if kind == "closed" and (wanted or (not options.only and path.stem in options.also)):
            found.append((faces, path.stem, path))
    return [path for _, _, path in sorted(found)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; 2 if there was nothing to run."""
    options = options_from(arguments)
    paths = find_meshes(options)
    if not paths:
        print(f"no closed mesh that is wanted in {', '.join(map(str, options.meshes))}", file=sys.stderr)
        return 2
    warm_up()
    runs: list[Run] = []
    for path in paths:
        try:
            runs += run_mesh(path, options)
        except NetError as error:
            print(f"{path.stem}: {error}", file=sys.stderr)
            continue
        print(mesh_table([r for r in runs if r.mesh == path.stem])[-1], file=sys.stderr, flush=True)
    print(
        "\n".join(
            [*mesh_table(runs), "", *method_table(runs), "", *(f"- {line}" for line in ratio_lines(runs))]
        )
    )
    if options.csv:
        write_csv(runs, options.csv)
    return 0


if __name__ == "__main__":
    sys.exit(main())
