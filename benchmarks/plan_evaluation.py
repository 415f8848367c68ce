"""How long one complete plan evaluation takes, how it grows, and what python-fcl takes for the same turns.

``python benchmarks/plan_evaluation.py [MESH …]`` prints CPU times. Without meshes it takes bumpy spheres of
128, 348, 1280 and 5000 faces that it makes itself. An evaluation is one call of ``FoldProblem.fold`` on one
net of which nothing is known, contact and sight on, kernels warm: order, rotary angles, every concession.
Beside it is the time of nets that are one exchange away from it, as a search meets them. ``--fcl N`` samples
at most N turns of each plan at 1 degree steps with python-fcl (one mesh for what moves, one for what stands
still); the time of the whole plan is scaled up from them. ``--cold`` also measures the one-off compilation
in an empty cache.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner import MachineLimits, make_net, read_goal
from planner.candidate import flat_tree
from planner.dual_graph import DualGraph
from planner.flat_layout import FlatLayout
from planner.fold_problem import FlatTree, FoldProblem, FoldResult
from planner.goal_mesh import GoalMesh
from planner.insets import edge_insets
from planner.plan_on_sheet import tree_of_net
from planner.proof_check import tree_of

SIZES = (128, 348, 1280, 5000)
TARGETS_MS = {128: 5.0, 348: 20.0, 1280: 150.0, 5000: 1500.0}
FCL_STEP_RAD = math.radians(1.0)
PRISM_FACES = np.array(
    [[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]]
)


def bumpy_sphere(faces: int, size_mm: float = 60.0) -> GoalMesh:
    """A closed goal of exactly ``faces`` (even) triangles with shallow hills and valleys; always the same."""
    from scipy.spatial import ConvexHull

    count = faces // 2 + 2
    k = np.arange(count) + 0.5
    height, turn = 1.0 - 2.0 * k / count, math.pi * (1.0 + math.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - height**2)
    points = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), height])
    hull = ConvexHull(points)
    corners = hull.simplices.astype(np.int64)
    middle = points[corners]
    inwards = (np.cross(middle[:, 1] - middle[:, 0], middle[:, 2] - middle[:, 0]) * middle[:, 0]).sum(1) < 0
    corners[inwards] = corners[inwards][:, ::-1]
    hills = 1.0 + 0.12 * np.sin(3.0 * points[:, 0] + 1.0) * np.cos(4.0 * points[:, 1]) * np.sin(
        3.0 * points[:, 2]
    )
    points = points * hills[:, None]
    return GoalMesh(points * size_mm / np.ptp(points, axis=0).max(), corners, f"bumpy sphere {faces}")


def cpu_ms(work: Callable[[], Any], runs: int) -> float:
    """Median process time of a call, ms."""
    took = []
    for _ in range(runs):
        start = time.process_time()
        work()
        took.append(1e3 * (time.process_time() - start))
    return statistics.median(took)


def neighbour_ms(problem: FoldProblem, layout: FlatLayout, count: int) -> float:
    """Median process time, ms, of folding ``count`` nets that are one exchange away from ``layout``."""
    rng = np.random.default_rng(0)
    problem.fold(flat_tree(layout, 0.0))
    took = []
    while len(took) < count:
        other = layout.copy()
        cut = int(rng.choice(np.flatnonzero(other.tree)))
        joins = rng.permutation(other.joinable(cut)).tolist()
        if any(join != cut and other.exchange(cut, join) for join in joins):
            tree = flat_tree(other, 0.0)
            took.append(cpu_ms(lambda t=tree: problem.fold(t), 1))
    return statistics.median(took)


def sampled_by_fcl(
    tree: FlatTree, problem: FoldProblem, result: FoldResult, most: int
) -> tuple[float, int, int]:
    """(CPU ms that fcl takes for all turns, turns that were sampled, turns in which it sees a contact)."""
    import fcl

    from planner._kernels.plan_kernels import turn_solids
    from planner._kernels.tree_kernels import subtree_ranges
    from planner.fold_problem import bounding_spheres

    def model(prisms: NDArray[np.float64]) -> Any:  # noqa: ANN401  fcl has no types
        faces = (PRISM_FACES[None] + 6 * np.arange(len(prisms))[:, None, None]).reshape(-1, 3)
        body = fcl.BVHModel()
        body.beginModel(6 * len(prisms), len(faces))
        body.addSubModel(np.ascontiguousarray(prisms.reshape(-1, 3)), faces)
        body.endModel()
        return fcl.CollisionObject(body)

    solids = problem.solids(tree)
    centres, _ = bounding_spheres(solids)
    preorder, first, last = subtree_ranges(tree.parent, tree.order)
    hinges, _ = tree.hinge_lines
    folds = result.steps[result.steps[:, 0] == 1]
    every = max(1, math.ceil(len(folds) / most))
    angle = np.zeros(len(tree.parent))
    total, sampled, touching = 0.0, 0, 0
    for number, (_, which, value) in enumerate(folds.tolist()):
        face, turn = int(which), value - angle[int(which)]
        members = preorder[first[face] : last[face]]
        ox, oy, ux, uy = hinges[face].tolist()
        if number % every == every // 2:
            start = time.process_time()
            still = np.ones(len(solids), np.bool_)
            still[members] = False
            still[tree.parent[face]] = False  # it shares the crease
            a, b = model(solids[members, :6]), model(solids[still, :6])
            pivot, sampled = np.array([ox, oy, 0.0]), sampled + 1
            for k in range(1, math.ceil(abs(turn) / FCL_STEP_RAD) + 1):
                t = math.copysign(min(abs(turn), k * FCL_STEP_RAD), turn)
                c, s = math.cos(t), math.sin(t)
                pose = np.array(
                    [
                        [c + ux * ux * (1 - c), ux * uy * (1 - c), uy * s],
                        [ux * uy * (1 - c), c + uy * uy * (1 - c), -ux * s],
                        [-uy * s, ux * s, c],
                    ]
                )
                a.setTransform(fcl.Transform(pose, pivot - pose @ pivot))
                if fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult()):
                    touching += 1
                    break
            total += 1e3 * (time.process_time() - start)
        turn_solids(solids, centres, members, ox, oy, ux, uy, turn)
        angle[face] = value
    return total * len(folds) / max(1, sampled), sampled, touching


def compile_cold() -> tuple[float, float]:
    """(wall, CPU) seconds that compiling all kernels takes in an empty cache, in a process of its own."""
    code = "from planner.warm_up import warm_up; warm_up()"
    with tempfile.TemporaryDirectory() as folder:
        before, start = os.times(), time.perf_counter()
        subprocess.run(
            [sys.executable, "-c", code], check=True, env={**os.environ, "NUMBA_CACHE_DIR": folder}
        )
        after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    return time.perf_counter() - start, cpu


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("meshes", type=Path, nargs="*")
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--fcl", type=int, default=100, help="turns to sample with python-fcl; 0: none")
    parser.add_argument("--neighbours", type=int, default=30, help="nets beside each that are folded as well")
    parser.add_argument("--tilt", type=float, default=45.0)
    parser.add_argument("--cold", action="store_true")
    options = parser.parse_args(arguments)
    goals = [read_goal(mesh, size_mm=60.0) for mesh in options.meshes] or [bumpy_sphere(n) for n in SIZES]
    limits = MachineLimits(max_tilt_rad=math.radians(options.tilt))
    print(f"{'goal':26} {'faces':>6} {'turns':>6} {'folded':>7} {'plan ms':>9} {'target':>7}"
          f" {'neighbour':>9} {'contact':>9} {'fcl 1 deg ms':>13} {'ratio':>7}")  # fmt: skip
    times = []
    for goal in goals:
        net = make_net(goal)
        insets = edge_insets(net, limits.thickness, limits.clearance)
        problem, tree = FoldProblem(goal, insets, limits), tree_of_net(net)
        contact_only = FoldProblem(goal, insets, limits, without=("sight",))
        problem.known_turns = contact_only.known_turns = 0
        result = problem.fold(tree)
        graph = DualGraph(goal)
        layout = FlatLayout(graph, tree_of(net, graph), net.base_face)
        near = neighbour_ms(FoldProblem(goal, insets, limits), layout, options.neighbours)
        took = cpu_ms(lambda p=problem, t=tree: p.fold(t), options.runs)
        blind = cpu_ms(lambda p=contact_only, t=tree: p.fold(t), options.runs)
        line = f"{goal.name[:26]:26} {len(goal.faces):6d} {int((result.steps[:, 0] == 1).sum()):6d}"
        target = TARGETS_MS.get(len(goal.faces), math.nan)
        line += f" {100 * result.completion:6.2f}% {took:9.2f} {target:7.0f} {near:9.2f} {blind:9.2f}"
        if options.fcl:
            fcl_ms, sampled, _ = sampled_by_fcl(tree, problem, result, options.fcl)
            line += f" {fcl_ms:13.0f} {fcl_ms / took:6.0f}x ({sampled} turns sampled)"
        print(line, flush=True)
        times.append((len(goal.faces), took))
    if len(times) > 1:
        n, t = np.log(np.array(times)).T
        print(f"growth: time ~ faces^{np.polyfit(n, t, 1)[0]:.2f}")
    if options.cold:
        wall, cpu = compile_cold()
        print(f"one-off compilation: {wall:.1f} s, {cpu:.1f} s of CPU")


if __name__ == "__main__":
    main()
