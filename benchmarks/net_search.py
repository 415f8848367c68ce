"""What a number of judged nets is worth: one chain of the search from the best start, and where the loss is.

``python benchmarks/net_search.py MESH … --nets 1200 --seed 0`` makes the starting nets as ``blossom plan``
does, takes the best and anneals from there, contact, sight and the clamped frame on, sheet and clips not yet.
Times are of the processor, kernels warm. The loss is told as a share of all wanted angles, by what ends the
turn of the creases that stay short: sight (hidden by the face itself, by what hangs on the crease, by others)
or contact (with the way to the base, with others, with the frame).
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner import make_net, read_goal
from planner.base_faces import rank_bases
from planner.candidate import Candidate, axis_angles, judge
from planner.dual_graph import DualGraph
from planner.fold_problem import FoldProblem
from planner.fold_search import SearchSettings, improve
from planner.insets import edge_insets
from planner.nearly_blooming import nearly_blooming
from rigs.limits import machine_limits
from rigs.material import load_material
from rigs.rig import load_rig

BY_SIGHT = 2
STARTS = 24


def best_start(problem: FoldProblem) -> Candidate:
    """The starting net that folds best, of those that the planner tries."""
    graph = DualGraph(problem.goal)
    attempts = [
        nearly_blooming(graph, rank.face, tree=rank.tree, seed=0)
        for rank in rank_bases(graph, STARTS, seed=0)
    ]
    axes = axis_angles(problem)
    judged = [
        judge(attempt.layout, problem, axis)
        for attempt in attempts
        if attempt.is_net
        for axis in (axes[0], axes[len(axes) // 2])
    ]
    return min(judged, key=lambda candidate: candidate.cost)


def losses(candidate: Candidate) -> Counter[str]:
    """Missing angle by cause, in per cent of all wanted angles."""
    tree, result = candidate.tree, candidate.result
    missing = np.abs(tree.target) - np.minimum(np.abs(result.reached), np.abs(tree.target))
    out: Counter[str] = Counter()
    for face in np.flatnonzero(result.cause).tolist():
        blocker = int(result.blocker[face])
        hangs, way = blocker, face
        while 0 <= hangs < len(tree.parent) and hangs != face:
            hangs = int(tree.parent[hangs])
        while way >= 0 and way != blocker:
            way = int(tree.parent[way])
        if result.cause[face] == BY_SIGHT:
            what = (
                "sight: itself"
                if blocker == face
                else "sight: its part"
                if hangs == face
                else "sight: others"
            )
        elif blocker >= len(tree.parent):
            what = "contact: frame"
        else:
            what = "contact: way to the base" if way == blocker else "contact: others"
        out[what] += float(100.0 * missing[face] / np.abs(tree.target).sum())
    return out


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("meshes", type=Path, nargs="+")
    parser.add_argument("--nets", type=int, default=1200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tilt", type=float, default=45.0, metavar="DEGREES")
    options = parser.parse_args(arguments)
    limits = machine_limits(load_rig("grbl-4axis"), load_material("304"))
    limits = replace(limits, max_tilt_rad=math.radians(options.tilt))
    print(
        "| mesh | start | cost | completion % | shape rms mm | rotations | ms a net | loss, % of the angles |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for path in options.meshes:
        net = make_net(read_goal(path))
        insets = edge_insets(net, limits.thickness, limits.clearance)
        problem = FoldProblem(net.goal, insets, limits)
        start = best_start(problem)
        began = time.process_time()
        best = improve(start, problem, SearchSettings(1, options.nets, options.seed))[0]
        each = 1e3 * (time.process_time() - began) / max(1, options.nets)
        result = best.result
        words = ", ".join(f"{what} {share:.2f}" for what, share in losses(best).most_common())
        print(
            f"| {path.stem} | {start.cost:.4f} | {best.cost:.4f} | {100 * result.completion:.2f} "
            f"| {result.shape_rms:.2f} | {result.rotations} | {each:.1f} | {words or 'none'} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
