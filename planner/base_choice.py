"""What was tried before a base face was chosen: the records that go into the bundle with the net."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from planner.base_faces import blooming_figures
from planner.base_trial import BaseTrial
from planner.blooming_trees import BLOOMING_TREES, TreeGrower
from planner.dual_graph import DualGraph
from planner.nearly_blooming import NetAttempt
from planner.net import NetCertificate

__all__ = ["RUNNERS_UP", "base_trials", "choice_of_bases"]

RUNNERS_UP = 8
"""Bases beside the chosen one that are recorded, the best ones."""


def base_trials(
    graph: DualGraph, attempts: Sequence[NetAttempt], quick_costs: Mapping[int, float] | None = None
) -> tuple[BaseTrial, ...]:
    """Records of attempts, in their order; of one base only the first, and no more than ``RUNNERS_UP + 1``.

    Args:
        graph: the dual graph of the goal.
        attempts: what was made of the bases, the best first.
        quick_costs: what the fold planner made of them, by place in ``attempts``; not all need to be there.
    """
    costs = quick_costs or {}
    grower = TreeGrower(graph)
    trials: dict[int, BaseTrial] = {}
    for place, attempt in enumerate(attempts):
        base = attempt.layout.base
        if base in trials or len(trials) > RUNNERS_UP:
            continue
        cost = costs.get(place, math.inf)
        trials[base] = BaseTrial(
            face=base,
            tree=attempt.tree,
            overlaps=attempt.blooming_overlaps,
            bound=_bound(grower, base, attempt.tree),
            edits=attempt.edits if attempt.is_net else -1,
            quick_cost=cost if math.isfinite(cost) else None,
        )
    return tuple(trials.values())


def choice_of_bases(
    graph: DualGraph,
    base: int,
    certificate: NetCertificate,
    quick_cost: float,
    trials: Sequence[BaseTrial],
) -> NetCertificate:
    """``certificate`` with its base as the chosen one and ``trials`` of other bases as the runners-up.

    Args:
        graph: the dual graph of the goal.
        base: the chosen base.
        certificate: of the chosen net.
        quick_cost: what the fold planner made of it without the sheet.
        trials: the bases that were tried, best first.
    """
    chosen = BaseTrial(
        face=base,
        tree=certificate.tree,
        overlaps=certificate.blooming_overlaps,
        bound=_bound(TreeGrower(graph), base, certificate.tree),
        edits=certificate.edits,
        quick_cost=quick_cost if math.isfinite(quick_cost) else None,
    )
    others = [trial for trial in trials if trial.face != base][:RUNNERS_UP]
    return replace(certificate, bases=(chosen, *others)) if others else certificate


def _bound(grower: TreeGrower, base: int, tree: str) -> int:
    """Fewest edits from a blooming tree; 0 for other trees."""
    return blooming_figures(grower, base, tree).bound if tree in BLOOMING_TREES else 0
