"""How fast nets are found, and with how few edits.

``python benchmarks/net_speed.py ../shared/meshes/real/bunny-348.obj``

One line for each mesh and blooming tree, over a seeded sample of bases (``--all-bases``: every one). Times
are processor time of this process after a first run, which compiles: search and restore with and without the
rounds by force. ``+MB`` is what the largest run added to the memory of the process.
"""

from __future__ import annotations

import argparse
import resource
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.blooming_trees import BLOOMING_TREES, TreeGrower, TreeName
from planner.dual_graph import DualGraph
from planner.goal_mesh import GoalMesh
from planner.nearly_blooming import NetAttempt, repair_tree
from planner.read_goal import read_goal


@dataclass(frozen=True)
class Run:
    """One base: the net, and milliseconds of the whole and of the whole without rounds by force."""

    attempt: NetAttempt
    whole_ms: float
    plain_ms: float
    plain_edits: int


def run_base(graph: DualGraph, grower: TreeGrower, base: int, tree: TreeName) -> Run:
    """Search and restore for one base, with and without rounds by force."""
    start = grower.blooming(base, tree)
    spent = []
    for rounds in (None, 0):
        clock = time.process_time()
        attempt = repair_tree(graph, start, base, name=tree, rounds=rounds)
        spent.append((attempt, 1000.0 * (time.process_time() - clock)))
    return Run(spent[0][0], spent[0][1], spent[1][1], spent[1][0].edits)


def memory_mb() -> float:
    """Largest memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def prepare(goal: GoalMesh) -> tuple[DualGraph, TreeGrower, float]:
    """Dual graph and tree grower with all that they compute once, and the milliseconds that took."""
    clock = time.process_time()
    graph = DualGraph(goal)
    grower = TreeGrower(graph)
    grower.blooming(0, "steepest")
    return graph, grower, 1000.0 * (time.process_time() - clock)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--bases", type=int, default=8, help="bases for each mesh and tree (default 8)")
    parser.add_argument("--all-bases", action="store_true", help="every base")
    parser.add_argument("--seed", type=int, default=0, help="of the sample of bases")
    options = parser.parse_args()
    columns = (
        "mesh", "faces", "graph ms", "tree", "bases", "nets", "overlaps", "edits (no rounds)", "ms", "max ms",
        "ms (no rounds)", "sum s", "+MB",
    )  # fmt: skip
    print("| " + " | ".join(columns) + " |")
    print("|---" * len(columns) + "|")
    for number, path in enumerate(options.meshes):
        goal = read_goal(path)
        graph, grower, prepared = prepare(goal)
        if number == 0:
            run_base(graph, grower, 0, "steepest")
            graph, grower, prepared = prepare(goal)
        count = len(goal.faces)
        bases = np.arange(count)
        if not options.all_bases and count > options.bases:
            bases = np.sort(np.random.default_rng(options.seed).choice(count, options.bases, replace=False))
        for tree in BLOOMING_TREES:
            before = memory_mb()
            runs = [run_base(graph, grower, base, tree) for base in bases.tolist()]
            nets = [run for run in runs if run.attempt.is_net]
            spent = [run.whole_ms for run in runs]
            edits = [[float(run.attempt.edits) for run in nets], [float(run.plain_edits) for run in nets]]
            print(
                f"| {path.stem} | {count} | {prepared:.0f} | {tree} | {len(runs)} | {len(nets)} "
                f"| {np.median([run.attempt.blooming_overlaps for run in runs]):g} "
                f"| {np.median(edits[0] or [np.nan]):g} ({np.median(edits[1] or [np.nan]):g}) "
                f"| {np.median(spent):.1f} | {max(spent):.1f} "
                f"| {np.median([run.plain_ms for run in runs]):.1f} "
                f"| {sum(spent) / 1000.0:.1f} | {memory_mb() - before:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
