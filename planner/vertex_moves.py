"""Directions in which the vertices of a goal may be moved so that it gets a net."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.dual_graph import DualGraph
from planner.goal_mesh import GoalMesh

__all__ = ["moved", "vertex_moves"]


def vertex_moves(
    graph: DualGraph, near: NDArray[np.int64], amplitude_mm: float, seed: int, draws: int
) -> Iterator[NDArray[np.float64]]:
    """Displacements (V, 3) of at most ``amplitude_mm`` per vertex, gentle ones first.

    First towards the mean of the neighbours, which lowers spikes and fills dents and so brings the angles
    around a vertex nearer to 360 degrees: only the vertices of the faces ``near`` that no flat panel has,
    then all of these, then all vertices. Then random directions, the vertices of ``near`` first.

    Args:
        graph: dual graph of the goal.
        near: faces that overlap.
        amplitude_mm: longest move.
        seed: of the random directions.
        draws: number of random displacements.
    """
    goal = graph.goal
    count = len(goal.vertices)
    amplitude_mm *= 1.0 - 1e-12  # so that rounding does not exceed it
    total, degree = np.zeros((count, 3)), np.zeros(count)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        for one, other in ((a, b), (b, a)):
            np.add.at(total, goal.faces[:, one], goal.vertices[goal.faces[:, other]])
            np.add.at(degree, goal.faces[:, one], 1.0)
    inwards = total / degree[:, None] - goal.vertices
    inwards *= np.minimum(1.0, amplitude_mm / np.maximum(np.linalg.norm(inwards, axis=1), 1e-12))[:, None]
    local, loose = np.zeros(count, dtype=np.bool_), np.ones(count, dtype=np.bool_)
    local[goal.faces[near]] = True
    loose[graph.vertices[graph.flat]] = False
    seen: list[NDArray[np.bool_]] = []
    for which in (local & loose, loose, np.ones(count, dtype=np.bool_)):
        if which.any() and not any(np.array_equal(which, other) for other in seen):
            seen.append(which)
            yield inwards * which[:, None]
    rng = np.random.default_rng([seed, 1])
    for draw in range(draws):
        direction = rng.normal(size=(count, 3))
        direction *= amplitude_mm / np.linalg.norm(direction, axis=1, keepdims=True)
        yield direction * local[:, None] if draw % 2 == 0 and local.any() else direction


def moved(goal: GoalMesh, displacement: NDArray[np.float64]) -> GoalMesh:
    """``goal`` with its vertices displaced by (V, 3) mm."""
    return replace(goal, vertices=goal.vertices + displacement)
