"""How far any net of a goal can fold at most: a face that leans over its crease hides it from the beam.

Outside-in folding turns a crease about a parent that lies flat, so the beam must come in between the two
faces. No beam leans further than the rig tilts, and a crease that folds further than upright plus that tilt
stays short in every net, in every order. A net needs a spanning tree of creases; the one that misses least
of what it wants to fold bounds them all.
"""

from __future__ import annotations

import math

import numpy as np

from planner.dual_graph import DualGraph
from planner.fold_orders import steepest_fold
from planner.fold_plan import MachineLimits
from planner.goal_mesh import GoalMesh

__all__ = ["bound_notice", "most_completion"]

WORTH_TELLING = 5e-4
"""A bound that is nearer to 1 is not told."""

SAME = 1e-12
"""Shares that differ by less are the same."""


def most_completion(goal: GoalMesh, limits: MachineLimits) -> float:
    """Upper bound on the completion of any plan for any net of ``goal``, 0 to 1.

    Source: Dinkelbach, On nonlinear fractional programming (1967): the least share of the wanted angle that
    is missing, over all spanning trees, by minimum spanning trees of ``missing - share * wanted``.

    Args:
        goal: the shape; all its faces in one net.
        limits: what the rig allows.

    Returns:
        1 if there is a tree without a crease that is too sharp.
    """
    graph = DualGraph(goal)
    wanted = np.where(graph.flat, 0.0, np.abs(graph.fold_angle))
    missing = np.maximum(0.0, wanted - steepest_fold(limits))
    share = 1.0
    while True:
        tree = graph.forest(np.argsort(missing - share * wanted, kind="stable"))
        folded = wanted[tree].sum()
        now = float(missing[tree].sum() / folded) if folded > 0.0 else 0.0
        if now >= share - SAME:
            return 1.0 - now
        share = now


def bound_notice(goal: GoalMesh, limits: MachineLimits) -> tuple[str, ...]:
    """What to tell the user about the bound, nothing where it does not matter."""
    most = most_completion(goal, limits)
    if most > 1.0 - WORTH_TELLING:
        return ()
    steepest = math.degrees(steepest_fold(limits))
    return (
        f"the beam sees no crease fold beyond {steepest:.1f}°, and this shape is sharper in too many places: "
        f"no net of it folds further than {100.0 * most:.1f} %; a rig that tilts further helps",
    )
