"""From a net to a whole fold plan: which net, where it lies, and the best plan on its sheet."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from itertools import chain

import numpy as np

from planner.angle_repair import repaired
from planner.base_choice import base_trials, choice_of_bases
from planner.base_faces import rank_bases
from planner.base_trial import BaseTrial
from planner.blooming_trees import BLOOMING_TREES
from planner.candidate import Candidate, axis_angles, done, judge
from planner.dual_graph import DualGraph
from planner.errors import NetError, PlanError
from planner.finalists import Finalist, NetOf, improve_on_sheet, on_its_sheet
from planner.flat_layout import FlatLayout
from planner.fold_bound import bound_notice
from planner.fold_plan import FoldPlan, MachineLimits
from planner.fold_problem import RULES, FoldProblem
from planner.fold_search import SEED_STEP, SearchSettings, improve, search
from planner.insets import edge_insets
from planner.nearly_blooming import NetAttempt, certify, nearly_blooming
from planner.net import Net
from planner.pattern_check import with_pattern
from planner.plan_on_sheet import plan_on_sheet, tree_of_net
from planner.processors import processors, side_by_side

__all__ = ["plan_folds"]

STARTS, CHAINS, FINALISTS = 24, 4, 8
ALWAYS_KEPT = ("outside-in", "side")
"""Rules that the greedy planner keeps by its construction, whatever is switched off."""

LEAST_GAIN = 0.002
"""A further net is not tried on its sheet unless it may be this much better."""

EVALUATION_BUDGET, MOST_EVALUATIONS = 140_000, 2800
"""Nets tried in one chain: the budget over the number of faces, but not more than the limit."""

SHEETS = 60
"""Sheets made in one chain of the search that goes on where the best nets lose folds to their sheets."""

REPAIRED, REPAIR_SHARE = 2, 0.03
"""Nets of the search whose angles are repaired; and how much of a time budget that may take for each."""

SEARCH_SHARE = 0.5
"""Share of the time that is given which goes to the search without the sheet; the rest to that with it."""

LEAST_CHAINS = 2
"""Where time is given: chains on fewer processors."""

ORDERS_SHARE = 8
"""Where the net is given, axes and orders are tried this many times less often than nets otherwise."""


def plan_folds(
    net: Net,
    limits: MachineLimits,
    *,
    seed: int = 0,
    budget_s: float | None = None,
    fixed_base: bool = False,
    keep_net: bool = False,
    hidden_max: float = 0.05,
    without: Collection[str] = (),
    on_progress: Callable[[float, str], None] | None = None,
) -> FoldPlan:
    """Plan how to fold ``net`` out of a sheet, all rules on; other nets of the goal are tried as well.

    The result depends on the input and the seed only, unless ``budget_s`` ended the search; the plan's
    notices then say so.

    Args:
        net: an overlap-free net of the goal.
        limits: what rig and material allow.
        seed: of every random choice.
        budget_s: the search stops after this time with what it has.
        fixed_base: keep the base face of ``net``.
        keep_net: fold ``net`` as it is; only other axes and orders are tried.
        hidden_max: largest hidden share of a crease.
        without: names of rules to switch off for a study; the plan records them.
        on_progress: called with the share done and a line of words.

    Raises:
        PlanError: if the sheet does not fit the machine, or the part cannot be held or turned.
        ValueError: if a rule in ``without`` is unknown or ``hidden_max`` is not a share.
    """
    unknown = sorted(set(without) - set(RULES))
    if unknown:
        raise ValueError(f"unknown rule {unknown[0]!r}; the rules are {', '.join(RULES)}")
    if not 0.0 <= hidden_max < 1.0:
        raise ValueError(f"hidden_max is a share from 0 to below 1, got {hidden_max}")
    tell = on_progress or (lambda _share, _words: None)
    insets = edge_insets(net, limits.thickness, limits.clearance)
    problem = FoldProblem(net.goal, insets, limits, hidden_max=hidden_max, without=without)
    settings = SearchSettings(CHAINS, 0, seed, fixed_base)
    further = replace(settings, evaluations=_evaluations(net), fixed_net=keep_net)
    most_sheets = SHEETS
    if budget_s is not None:
        began, chains, grace_s = time.monotonic(), max(LEAST_CHAINS, processors()), REPAIR_SHARE * budget_s
        half, end = began + SEARCH_SHARE * budget_s, began + budget_s
        settings = replace(settings, chains=chains, deadline=half, grace_s=grace_s)
        further = replace(further, evaluations=sys.maxsize, deadline=end, grace_s=grace_s)
        most_sheets = sys.maxsize
    found, trials, notices = _nets_to_fold(net, problem, settings, keep_net, tell)
    if problem.use_sight:
        notices += bound_notice(net.goal, limits)
    notices += tuple(
        f"rule {rule} is kept all the same: this planner cannot do without it"
        for rule in ALWAYS_KEPT
        if rule in without
    )

    def net_of(candidate: Candidate) -> tuple[Net, float | None]:
        return _net_of(candidate, net, keep_net, trials)

    tried: list[Finalist] = []
    refused: PlanError | None = None
    for number, candidate in enumerate(found):
        if tried and (tried[0].cost <= candidate.cost + LEAST_GAIN or number >= FINALISTS):
            break  # the sheet only ever takes away from what the search found
        tell(0.9 + 0.03 * number / len(found), "folding with the sheet in place")
        try:
            tried.append(on_its_sheet(candidate, net_of, problem, without))
        except PlanError as error:
            refused = refused or error
        tried.sort(key=lambda finalist: finalist.cost)
    loses = bool(tried) and tried[0].cost > found[0].cost + LEAST_GAIN
    if loses or (tried and budget_s is not None and not further.late):
        tell(0.93, "improving the net with the sheet in place")
        tried = _improved(tried, problem, further, most_sheets, net_of, without)
    others = (candidate for candidate in found if all(candidate is not f.candidate for f in tried))
    for finalist in chain(tried, _on_their_sheets(others, net_of, problem, without)):
        tell(0.97, "cutting and holding")
        try:
            plan = plan_on_sheet(
                finalist.placed, finalist.sheet, problem, seed, tuple(sorted(without)), notices,
                finalist.folded,
            )  # fmt: skip
        except PlanError as error:
            refused = refused or error
            continue
        return with_pattern(plan)
    assert refused is not None  # noqa: S101 - there is at least one net
    raise refused


def _on_their_sheets(
    candidates: Iterable[Candidate], net_of: NetOf, problem: FoldProblem, without: Collection[str]
) -> Iterator[Finalist]:
    """Further nets on their sheets, made when they are asked for; those that fit none are passed over."""
    for candidate in candidates:
        with suppress(PlanError):
            yield on_its_sheet(candidate, net_of, problem, without)


def _improved(
    tried: list[Finalist],
    problem: FoldProblem,
    settings: SearchSettings,
    most_sheets: int,
    net_of: NetOf,
    without: Collection[str],
) -> list[Finalist]:
    """All of ``tried``, and what two become if the search goes on with the sheet in place.

    These are the best on its sheet and, as it may need little only, the one that folds best without.
    """
    hopeful = min(tried, key=lambda finalist: finalist.candidate.cost)
    heads = [tried[0], hopeful if hopeful is not tried[0] else tried[min(1, len(tried) - 1)]]
    with ThreadPoolExecutor(len(heads)) as pool:
        better = pool.map(
            lambda k: improve_on_sheet(
                heads[k],
                net_of,
                problem,
                replace(settings, seed=settings.seed + SEED_STEP * k),
                most_sheets,
                without,
            ),
            range(len(heads)),
        )
        return sorted([*better, *tried], key=lambda finalist: finalist.cost)


def _nets_to_fold(
    net: Net,
    problem: FoldProblem,
    settings: SearchSettings,
    keep_net: bool,
    tell: Callable[[float, str], None],
) -> tuple[list[Candidate], tuple[BaseTrial, ...], tuple[str, ...]]:
    """Nets that fold well, best first, the bases that were tried, best first, and notices.

    The further ones stand in where the sheet around a better one cannot be held or turned.
    """
    graph = DualGraph(net.goal)
    tree = tree_of_net(net)
    mask = np.zeros(len(graph.faces), dtype=np.bool_)
    joined = np.flatnonzero(tree.parent >= 0)
    mask[graph.face_edges[joined, tree.slot[joined]]] = True
    given = FlatLayout(graph, mask, net.base_face)
    if given.overlaps:
        pairs = tuple(sorted(set(given.overlapping_pairs().ravel().tolist())))
        raise NetError(f"the net overlaps itself at faces {', '.join(map(str, pairs[:8]))}", pairs)
    evaluations = _evaluations(net)
    trials: tuple[BaseTrial, ...] = ()
    if keep_net:
        tell(0.0, "other axes and orders for the net")
        tried = (judge(given, problem, axis, own=0.0) for axis in axis_angles(problem))
        start = min(tried, key=lambda c: c.cost)
        orders = replace(settings, evaluations=evaluations // ORDERS_SHARE, fixed_net=True)
        found = [start] if done(start) else improve(start, problem, orders)
    else:
        starts = _starts(graph, net.base_face, settings.fixed_base, settings.seed)
        further = replace(settings, evaluations=evaluations)
        found = search([given, *(start.layout for start in starts)], problem, further, tell)
        better = side_by_side(
            lambda candidate: repaired(candidate, problem, settings.repair_until), found[:REPAIRED]
        )
        found = sorted([*better, *found[REPAIRED:]], key=lambda candidate: candidate.cost)
        if not settings.fixed_base:
            costs = {id(candidate.layout): candidate.cost for candidate in found}
            starts.sort(key=lambda start: costs.get(id(start.layout), math.inf))
            quick = [costs.get(id(start.layout), math.inf) for start in starts]
            trials = base_trials(graph, starts, dict(enumerate(quick)))
    notices: tuple[str, ...] = ()
    if settings.late:
        notices = (
            "the time budget ended the search, so another run may give another plan; a larger --budget helps",
        )
    return found[: 3 * FINALISTS], trials, notices


def _evaluations(net: Net) -> int:
    """How many nets one chain of the search tries."""
    return min(MOST_EVALUATIONS, EVALUATION_BUDGET // len(net.faces))


def _net_of(
    candidate: Candidate, net: Net, keep_net: bool, trials: tuple[BaseTrial, ...]
) -> tuple[Net, float | None]:
    """The net of a candidate with its certificate, and the rotary axis in it (None: any that fits)."""
    layout = candidate.layout
    made = net
    if not keep_net:
        certificate = certify(layout, net.certificate.method)
        made = layout.to_net(choice_of_bases(layout.graph, layout.base, certificate, candidate.cost, trials))
    start, end = made.vertices[made.faces[made.base_face, :2]]
    heading = math.atan2(end[1] - start[1], end[0] - start[0])
    return made, heading + candidate.axis_rad if math.isfinite(candidate.cost) else None


def _starts(graph: DualGraph, base: int, fixed_base: bool, seed: int) -> list[NetAttempt]:
    """Overlap-free nets to start from: promising bases, or other trees of the one base."""
    if fixed_base:
        attempts = [
            nearly_blooming(graph, base, tree=name, seed=seed + round_)
            for round_ in range(2)
            for name in BLOOMING_TREES
        ]
    else:
        ranked = rank_bases(graph, STARTS, seed=seed)
        attempts = [nearly_blooming(graph, rank.face, tree=rank.tree, seed=seed) for rank in ranked]
    return [attempt for attempt in attempts if attempt.is_net]
