"""The first run: compiling the kernels of nets and folds, and leaving their machine code for later runs.

It takes several seconds once per version, and nothing afterwards. Nets and folds are compiled side by side,
each in a process of its own, because numba compiles one function at a time in one process.
"""

from __future__ import annotations

import gc
import importlib
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.fold_problem import FoldProblem
    from planner.goal_mesh import GoalMesh

__all__ = ["kernels_are_cached", "kernels_can_be_kept", "warm_up"]

_MODULES = (
    "base", "hold", "nb", "net", "no_good", "overlap", "own_sight", "plan", "restore", "search", "shadow",
    "tree", "view",
)  # fmt: skip

CHILD_TIMEOUT_S = 300.0
"""After this time a process that compiles is given up; what it has not left is then compiled here."""

LOOK_AGAIN_S = 0.5
"""How often is looked how much is compiled."""

_POINTS = np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 20.0]])
"""Corners of a small tetrahedron, mm."""


def kernels_can_be_kept() -> bool:
    """True if there is a directory to keep machine code in; else every run compiles.

    It is in the one that ``NUMBA_CACHE_DIR`` names, in the package, or in the user's cache.
    """
    from planner._kernels.compiled import cache_directory

    return cache_directory is not None


def kernels_are_cached() -> bool:
    """True if nothing has to be compiled: all machine code is on disk, or in this process already."""
    from planner._kernels.compiled import KERNELS, kernel_is_cached

    _load_kernels()
    return all(kernel_is_cached(kernel) for kernel in KERNELS)


def warm_up(on_progress: Callable[[float, str], None] | None = None) -> None:
    """Compile all kernels and keep their machine code for later runs; returns at once if it is there.

    Nothing depends on it: kernels that are not there are compiled when they are first called.

    Args:
        on_progress: called with the share done (0 to 1) and what is being done.
    """
    from planner._kernels.compiled import cache_directory

    if kernels_are_cached():
        return
    tell = on_progress or (lambda _share, _text: None)
    if cache_directory is not None:
        _compile_in_children(cache_directory.parent, tell)
    if not kernels_are_cached():
        with _no_collection():
            for number, (part, compile_part) in enumerate(PARTS.items()):
                tell(number / len(PARTS), f"compiling the kernels of {part}")
                compile_part()
    tell(1.0, "kernels are ready")


def compile_net_kernels() -> None:
    """Call every kernel of nets once, on a tetrahedron."""
    from planner._kernels import search_kernels
    from planner._kernels.base_kernels import packed_paths
    from planner._kernels.shadow_kernels import WORDS
    from planner.blooming_trees import blooming_tree
    from planner.dual_graph import DualGraph
    from planner.flat_layout import FlatLayout
    from planner.goal_mesh import GoalMesh
    from planner.nearly_blooming import restore
    from planner.no_goods import PathFinder
    from planner.own_sight import HEADINGS, OwnSight

    goal = GoalMesh(_POINTS, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]), "tetrahedron")
    graph = DualGraph(goal)
    layout = FlatLayout(graph, blooming_tree(graph, 0), 0)
    pairs = np.zeros((4, 2), dtype=np.int64)
    search_kernels.search(layout.arrays, layout.outline, pairs, 0, np.ones(1, dtype=np.uint64), 1, 1)
    for cut in np.flatnonzero(layout.tree).tolist():
        for join in layout.joinable(cut).tolist():
            if layout.tree[cut] and layout.exchange(cut, join):
                layout.undo()
    layout.path(0, 1)
    PathFinder(graph).short(2, 10)
    restore(layout, layout.tree, False)
    packed_paths(layout.arrays, pairs, 0)
    # an empty table: the kernels that work one out are compiled with those of the folds, which share theirs
    creases = 2 * len(graph.faces)
    nothing = np.full((creases, 4), -1, dtype=np.int32), np.zeros((HEADINGS, creases, WORDS), dtype=np.uint64)
    table = OwnSight(_problem(goal), nothing)
    rng = np.random.default_rng(0)
    table.cost(layout, 0.0)
    table.exchange(layout.copy(), 0.0, np.flatnonzero(layout.tree), 1.0, 1, rng)
    table.anneal(layout, 0.0, 1, rng)


def compile_fold_kernels() -> None:
    """Call every kernel of folds once, on two triangles, and those that work out what hides what."""
    from planner.fold_problem import FlatTree
    from planner.fold_state import FoldState, beams_of_side
    from planner.goal_mesh import GoalMesh
    from planner.hold_gap import hold_gap
    from planner.own_sight import OwnSight
    from planner.sheet_hits import sheet_hits

    tree = FlatTree(
        base=0,
        parent=np.array([-1, 0]),
        slot=np.array([-1, 0]),
        order=np.array([0, 1]),
        corners=np.array([[[0.0, 0.0], [20.0, 0.0], [0.0, 20.0]], [[20.0, 0.0], [0.0, 0.0], [0.0, -20.0]]]),
        target=np.array([0.0, np.pi / 2]),
        axis=np.array([1.0, 0.0]),
    )
    problem = _problem(GoalMesh(_POINTS, np.array([[0, 1, 2], [1, 0, 3]]), "two triangles"))
    result = problem.fold(tree)
    sheet_hits(tree, result, problem, problem.solids(tree))
    hold_gap(tree, result, problem)
    FoldState(problem, tree).reach(1, beams_of_side(0.1, top=True))
    OwnSight(problem)


def _problem(goal: GoalMesh) -> FoldProblem:
    """How to fold a goal, with limits that do not matter."""
    from planner.fold_plan import MachineLimits
    from planner.fold_problem import FoldProblem

    return FoldProblem(goal, np.full((len(goal.faces), 3), 0.1), MachineLimits())


def _load_kernels() -> None:
    """Import every module whose kernels are compiled beforehand."""
    for name in _MODULES:
        importlib.import_module(f"planner._kernels.{name}_kernels")


@contextmanager
def _no_collection() -> Iterator[None]:
    """Without cyclic garbage collection, which would take a fifth of the time for nothing."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _compile_in_children(cache_parent: Path, tell: Callable[[float, str], None]) -> None:
    """Compile every part in a process of its own and wait for them; what goes wrong there is left undone."""
    from planner._kernels.compiled import KERNELS, kernel_is_cached

    children = [child for part in PARTS if (child := _start_child(part, cache_parent)) is not None]
    until = time.monotonic() + CHILD_TIMEOUT_S
    try:
        while (running := [child for child in children if child.poll() is None]) and time.monotonic() < until:
            share = sum(map(kernel_is_cached, KERNELS)) / len(KERNELS)
            tell(share, "compiling the kernels of " + " and ".join(PARTS))
            with suppress(subprocess.TimeoutExpired):
                running[0].wait(LOOK_AGAIN_S)
    finally:
        for child in children:
            if child.poll() is None:
                child.kill()
                child.wait()


def _start_child(part: str, cache_parent: Path) -> subprocess.Popen[bytes] | None:
    """Start the compilation of a part in a process of its own; None if that is impossible here."""
    root = str(Path(__file__).parent.parent)
    paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
    settings = {
        "PYTHONPATH": os.pathsep.join(paths),
        "NUMBA_CACHE_DIR": str(cache_parent),
        # the time to run does not depend on the level, the time to compile does
        "NUMBA_OPT": "1",
        # numba writes, and would colour, messages of all that it tries in vain
        "NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING": "1",
    }
    if not sys.executable or getattr(sys, "frozen", False):
        return None
    try:
        return subprocess.Popen(  # noqa: S603 - this program
            [sys.executable, "-P", "-m", "planner.warm_up", part],
            env={**os.environ, **settings},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except OSError:
        return None


PARTS: dict[str, Callable[[], None]] = {"nets": compile_net_kernels, "folds": compile_fold_kernels}
"""What is compiled side by side; both take about as long."""


if __name__ == "__main__":
    gc.disable()
    PARTS[sys.argv[1]]()
