"""RRT-Connect of OMPL over the joint space: all creases may turn at once, contact is the only rule.

OMPL is not needed by the product: ``pip install metal-blossom[ompl]`` adds it. Source: Kuffner and LaValle,
"RRT-Connect: An efficient approach to single-query path planning", ICRA 2000; OMPL's implementation.
"""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import PlanError
from planner.linear_folding import JointMotion

__all__ = ["DEFAULT_BUDGET_S", "best_of_rrt_connect"]

RELIEF, MOST_RELIEFS = 0.998, 3000
"""A crease between two faces that touch at the goal is opened by this factor, so often at most."""

DEFAULT_BUDGET_S = 10.0
WORK_PER_SECOND = 700_000.0
"""Advances of pairs of faces that count as one second."""


def best_of_rrt_connect(
    motion: JointMotion, seed: int, budget_s: float | None = None
) -> tuple[NDArray[np.float64], str]:
    """Angles (F,) nearest to the goal that OMPL's RRT-Connect reaches from the flat sheet.

    Every motion of its tree is checked by conservative advancement. The budget counts their work.

    Args:
        motion: the net.
        seed: of OMPL's random numbers.
        budget_s: nominal seconds.

    Returns:
        (angles, what ended the search in words, empty if the goal was reached). Without a way to the goal
        these are the angles of the best state in the tree that grows from the flat sheet.

    Raises:
        PlanError: if OMPL is not installed.
    """
    modules: tuple[Any, Any] = _ompl(seed)
    base, geometric = modules
    target = motion.tree.target
    creases = np.flatnonzero(target)
    if len(creases) == 0:
        return np.zeros(len(target)), ""
    aim = _free_goal(motion)
    if aim is None:
        return np.zeros(len(target)), "faces touch at the goal and near it, so there is no state to aim at"
    signed = target[creases]

    def angles(state: Any) -> NDArray[np.float64]:  # noqa: ANN401  OMPL's states have no Python type
        out = np.zeros(len(target))
        out[creases] = signed * np.clip([state[k] for k in range(len(creases))], 0.0, 1.0)
        return out

    seconds = DEFAULT_BUDGET_S if budget_s is None else budget_s
    most = motion.work + int(seconds * WORK_PER_SECOND)

    def spent() -> bool:
        return motion.work >= most

    class Motions(base.MotionValidator):  # type: ignore[misc,name-defined]  # OMPL is an option
        """Straight motions between two states, checked as a whole."""

        def checkMotion(self, start: Any, end: Any) -> bool:  # noqa: ANN401, N802  OMPL's name
            return not spent() and motion.free(angles(start), angles(end)).face < 0

    space = base.RealVectorStateSpace(len(creases))
    space.setBounds(0.0, 1.0)
    information = base.SpaceInformation(space)
    information.setStateValidityChecker(lambda state: motion.free(angles(state), angles(state)).face < 0)
    validator = Motions(information)
    information.setMotionValidator(validator)
    information.setup()
    problem = base.ProblemDefinition(information)
    flat, goal = information.allocState(), information.allocState()
    for k in range(len(creases)):
        flat[k], goal[k] = 0.0, aim[creases[k]] / signed[k]
    problem.setStartAndGoalStates(flat, goal)
    planner = geometric.RRTConnect(information)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(base.PlannerTerminationCondition(spent))
    if problem.hasExactSolution():
        share = float(np.abs(aim).sum() / np.abs(target).sum())
        return aim, "" if share == 1.0 else f"faces touch at the goal: aimed at {share:.2%} of the angles"
    data = base.PlannerData(information)
    planner.getPlannerData(data)
    return _best_in_start_tree(data, angles, len(target)), "no way to the goal was found in the budget"


def _free_goal(motion: JointMotion) -> NDArray[np.float64] | None:
    """The goal angles (F,), a little less on the ways between faces that touch there; None if in vain."""
    angles = motion.tree.target.copy()
    for number in range(MOST_RELIEFS):
        touch = motion.free(angles, angles)
        if touch.face < 0:
            return angles
        way = [face for face in _way(motion.tree.parent, touch.face, touch.other) if angles[face] != 0.0]
        if not way:
            break
        angles[way[number % len(way)]] *= RELIEF
    return None


def _way(parent: NDArray[np.int64], face: int, other: int) -> list[int]:
    """Faces whose creases lie on the way through the net between two faces."""
    lines: list[list[int]] = []
    for start in (face, other):
        line = [start]
        while parent[line[-1]] >= 0:
            line.append(int(parent[line[-1]]))
        lines.append(line)
    shared = set(lines[0]) & set(lines[1])
    return [f for line in lines for f in line if f not in shared]


def _best_in_start_tree(data: Any, angles: Any, count: int) -> NDArray[np.float64]:  # noqa: ANN401  OMPL's types
    """The state with the most folding among those that the start is joined to."""
    best = np.zeros(count)
    seen, todo = set(), [data.getStartIndex(k) for k in range(data.numStartVertices())]
    while todo:
        number = todo.pop()
        if number in seen:
            continue
        seen.add(number)
        found = angles(data.getVertex(number).getState())
        if np.abs(found).sum() > np.abs(best).sum():
            best = found
        todo += list(data.getEdges(number))
    return best


def _ompl(seed: int) -> tuple[Any, Any]:
    """``ompl.base`` and ``ompl.geometric`` with seeded random numbers and no messages."""
    try:
        import ompl
        from ompl import base, geometric, util
    except ImportError as error:
        raise PlanError(
            "the planner rrt-connect needs OMPL, which is not installed: pip install 'metal-blossom[ompl]'"
        ) from error
    util.setLogLevel(util.LogLevel.LOG_NONE)
    # the Python bindings leave out RNG::setSeed(std::uint_fast32_t), so it is called in the library itself
    try:
        library = ctypes.CDLL(str(next(Path(ompl.__file__).parent.glob("libompl.*"))))
        library["_ZN4ompl3RNG7setSeedEm"](ctypes.c_ulong(seed + 1))
    except (StopIteration, OSError, AttributeError) as error:
        raise PlanError(
            "the random numbers of this build of OMPL cannot be seeded, and without a seed its result could "
            "not be repeated; use ompl 2.0.1 from PyPI on Linux"
        ) from error
    return base, geometric
