"""From a net to a whole fold plan: search, placement, sheet, folds, clips, cuts and tabs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.base_faces import rank_bases
from planner.blooming_trees import BLOOMING_TREES
from planner.clearance import check_rotation_clearance
from planner.dual_graph import DualGraph
from planner.errors import NetError, PlanError
from planner.fabrication import check_held, fabrication_steps
from planner.flat_layout import FlatLayout
from planner.fold_plan import Blocked, Fold, FoldPlan, MachineLimits, PlanMetrics, Rotate, Sheet
from planner.fold_problem import RULES, FlatTree, FoldProblem, FoldResult, bounding_spheres, hinge_lines
from planner.fold_search import SearchSettings, axis_angles, judge, search
from planner.holding import Hold, hold_base
from planner.insets import edge_insets
from planner.nearly_blooming import certify, nearly_blooming
from planner.net import Net
from planner.placement import place_net
from planner.substrate import make_sheet

__all__ = ["plan_folds"]

STARTS, CHAINS, FINALISTS = 24, 2, 8
ALWAYS_KEPT = ("outside-in", "side")
"""Rules that the greedy planner keeps by its construction, whatever is switched off."""

LEAST_GAIN = 0.002
"""A further net is not tried on its sheet unless it may be this much better."""

EVALUATION_BUDGET, MOST_EVALUATIONS = 110_000, 2200
"""Nets tried in one chain: the budget over the number of faces, but not more than the limit."""


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
        keep_net: fold ``net`` as it is; no other net is tried.
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
    deadline = None if budget_s is None else time.monotonic() + budget_s
    nets, notices = _nets_to_fold(net, problem, seed, deadline, fixed_base, keep_net, tell)
    notices += tuple(
        f"rule {rule} is kept all the same: this planner cannot do without it"
        for rule in ALWAYS_KEPT
        if rule in without
    )
    best: FoldPlan | None = None
    refused: PlanError | None = None
    for number, (chosen, axis_rad, promise) in enumerate(nets):
        if best is not None and (plan_cost(best) <= promise + LEAST_GAIN or number >= FINALISTS):
            break  # the sheet only ever takes away from what the search found
        tell(0.9 + 0.09 * number / len(nets), "folding with the sheet in place")
        try:
            placed = place_net(chosen, limits, axis_rad)
            sheet = make_sheet(placed, limits)
            plan = _plan_on_sheet(placed, sheet, problem, seed, tuple(sorted(without)), notices)
        except PlanError as error:
            refused = refused or error
            continue
        if best is None or plan_cost(plan) < plan_cost(best):
            best = plan
    if best is None:
        assert refused is not None  # noqa: S101 - there is at least one net
        raise refused
    return best


def plan_cost(plan: FoldPlan) -> float:
    """What the choice among finished plans makes small; see ``fold_search.cost``."""
    relative = plan.metrics.shape_rms / plan.net.goal.longest_side_mm
    return 1.0 - plan.metrics.fold_completion + 0.25 * relative


def _nets_to_fold(
    net: Net,
    problem: FoldProblem,
    seed: int,
    deadline: float | None,
    fixed_base: bool,
    keep_net: bool,
    tell: Callable[[float, str], None],
) -> tuple[list[tuple[Net, float | None, float]], tuple[str, ...]]:
    """Nets that fold well, best first: net, rotary axis in it (None: any that fits), cost; and notices.

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
    evaluations = min(MOST_EVALUATIONS, EVALUATION_BUDGET // len(net.faces))
    settings = SearchSettings(CHAINS, evaluations, seed, fixed_base, deadline)
    if keep_net:
        found = [min((judge(given, problem, axis) for axis in axis_angles(problem)), key=lambda c: c.cost)]
    else:
        found = search([given, *_starts(graph, net.base_face, fixed_base, seed)], problem, settings, tell)
    notices: tuple[str, ...] = ()
    if settings.late:
        notices = (
            "the time budget ended the search, so another run may give another plan; a larger --budget helps",
        )
    nets = []
    for candidate in found[: 3 * FINALISTS]:
        layout = candidate.layout
        made = net if keep_net else layout.to_net(certify(layout, net.certificate.method))
        start, end = made.vertices[made.faces[made.base_face, :2]]
        heading = math.atan2(end[1] - start[1], end[0] - start[0])
        axis_rad = heading + candidate.axis_rad if math.isfinite(candidate.cost) else None
        nets.append((made, axis_rad, candidate.cost))
    return nets, notices


def _starts(graph: DualGraph, base: int, fixed_base: bool, seed: int) -> list[FlatLayout]:
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
    return [attempt.layout for attempt in attempts if attempt.is_net]


def _plan_on_sheet(
    net: Net,
    sheet: Sheet,
    problem: FoldProblem,
    seed: int,
    without: tuple[str, ...],
    notices: tuple[str, ...],
) -> FoldPlan:
    """Fold the placed net with the frame and the hold of the base in the way, then add cuts and clips."""
    limits = problem.limits
    tree = tree_of_net(net)
    sweeps_sheet = "substrate" not in without
    bodies = sheet_solids(sheet, limits.thickness)
    kept = np.flatnonzero(sheet.frame_faces)
    for _ in range(3):
        result = problem.fold(tree, obstacles=bodies[kept] if sweeps_sheet else None)
        folds = fold_steps(net, result)
        hits = sheet_hits(tree, result, problem, bodies) if sweeps_sheet else {}
        hit = frozenset(hits) - frozenset(kept.tolist())
        hold = hold_base(net, sheet, limits, hit)
        if not hold.needed:
            break
        kept = np.union1d(kept, np.array(sorted(hold.tether | hold.needed), dtype=np.int64))
    if hold.needed and "held" not in without:
        raise PlanError(
            f"the base face {net.base_face} cannot be held: the folds sweep every way from it to the frame. "
            "Choose another base face (--base)"
        )
    steps = fabrication_steps(net, sheet, hold, folds, hits)
    plan = FoldPlan(
        net=net,
        sheet=replace(sheet, tabs=hold.tabs),
        limits=limits,
        steps=steps,
        metrics=_metrics(net, sheet, hold, result),
        blocked=_blocked(net, result, kept),
        hidden_max=problem.hidden_max,
        without=without,
        seed=seed,
        notices=notices,
    )
    _check(plan, without)
    return plan


def tree_of_net(net: Net) -> FlatTree:
    """The placed ``net`` as plain arrays; its rotary axis runs along +x."""
    count = len(net.faces)
    slot = np.full(count, -1, dtype=np.int64)
    target = np.zeros(count)
    for face in net.order[1:].tolist():
        edge = int(net.crease_of[face])
        ends = set(net.edges[edge].tolist())
        corners = net.faces[face].tolist()
        slot[face] = next(k for k in range(3) if {corners[k], corners[(k + 1) % 3]} == ends)
        if net.assignment[edge] != "F":
            target[face] = net.fold_angle[edge]
    return FlatTree(
        base=net.base_face,
        parent=np.array(net.parent),
        slot=slot,
        order=np.array(net.order),
        corners=net.vertices[net.faces],
        target=target,
        axis=np.array([1.0, 0.0]),
    )


def fold_steps(net: Net, result: FoldResult) -> tuple[Rotate | Fold, ...]:
    """The planner's result as steps."""
    steps: list[Rotate | Fold] = []
    for kind, which, angle in result.steps.tolist():
        if int(kind) == 0:
            steps.append(Rotate(float(angle)))
        else:
            steps.append(Fold(int(net.crease_of[int(which)]), float(angle)))
    return tuple(steps)


def sheet_solids(sheet: Sheet, thickness: float) -> NDArray[np.float64]:
    """(T, 12, 3) the substrate triangles as solids: prism, triangle, triangle."""
    flat = np.zeros((len(sheet.faces), 3, 3))
    flat[:, :, :2] = sheet.triangles
    up = np.array([0.0, 0.0, 0.5 * thickness])
    return np.concatenate([flat + up, flat - up, flat, flat], axis=1)


def sheet_hits(
    tree: FlatTree, result: FoldResult, problem: FoldProblem, bodies: NDArray[np.float64]
) -> dict[int, int]:
    """Substrate triangles that the folds sweep → number of the first fold that does."""
    from planner._kernels.contact_kernels import turn_contact
    from planner._kernels.plan_kernels import turn_solids
    from planner._kernels.tree_kernels import subtree_ranges

    count = len(tree.parent)
    solids = np.concatenate([problem.solids(tree), bodies])
    centres, radii = bounding_spheres(solids)
    preorder, first, last = subtree_ranges(tree.parent, tree.order)
    hinges, _ = hinge_lines(tree)
    present = np.arange(len(solids)) >= count
    moving, work = np.zeros(len(solids), np.bool_), np.empty((30, 3))
    sharp = np.concatenate([problem.sharp, np.zeros(len(bodies), np.bool_)])
    angle = np.zeros(count)
    found: dict[int, int] = {}
    for number, (_, which, value) in enumerate(result.steps[result.steps[:, 0] == 1].tolist()):
        face = int(which)
        turn = value - angle[face]
        members = preorder[first[face] : last[face]]
        ox, oy, ux, uy = (float(x) for x in hinges[face])
        sign = math.copysign(1.0, turn)
        moving[members] = True
        while True:
            _, _, body = turn_contact(
                face, int(tree.parent[face]), members, moving, solids, centres, radii, sharp, present,
                ox, oy, sign * ux, sign * uy, abs(turn), work,
            )  # fmt: skip
            if body < 0:
                break
            found[int(body) - count] = number
            present[body] = False
        moving[members] = False
        turn_solids(solids, centres, members, ox, oy, ux, uy, turn)
        angle[face] = value
    return found


def _metrics(net: Net, sheet: Sheet, hold: Hold, result: FoldResult) -> PlanMetrics:
    """Figures of the plan; energy and time are added when the process is known."""
    clipped = sorted(hold.clipped)
    a, b, c = (sheet.triangles[clipped, k] for k in range(3))
    area = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum()
    return PlanMetrics(
        fold_completion=result.completion,
        shape_rms=result.shape_rms,
        shape_rms_rel=result.shape_rms / float(np.linalg.norm(np.ptp(net.goal.vertices, axis=0))),
        rotations=result.rotations,
        clipped_faces=len(clipped),
        clipped_area=float(area),
    )


def _blocked(net: Net, result: FoldResult, kept: NDArray[np.int64]) -> tuple[Blocked, ...]:
    """Creases that stay short of the goal, with what stops them."""
    out = []
    for face in np.flatnonzero(result.cause != 0).tolist():
        edge = int(net.crease_of[face])
        blocker = int(result.blocker[face])
        by: str = "sight" if result.cause[face] == 2 else "collision"
        blockers: tuple[int, ...] = () if blocker < 0 else (blocker,)
        if blocker >= len(net.faces):
            by, blockers = "substrate", (int(kept[blocker - len(net.faces)]),)
        elif by == "collision":
            blockers = (face, blocker)
        out.append(
            Blocked(
                crease=edge,
                reached_rad=float(result.reached[face]),
                wanted_rad=float(net.fold_angle[edge]),
                by=by,  # type: ignore[arg-type]  # one of the four literals above
                blockers=blockers,
                at_rad=float(math.copysign(result.stopped_at[face], net.fold_angle[edge])),
            )
        )
    return tuple(out)


def _check(plan: FoldPlan, without: tuple[str, ...]) -> None:
    """Replay the rules that no search looks at: held and rotation clearance."""
    if "held" not in without:
        problems = check_held(plan)
        if problems:
            raise PlanError(f"the plan would drop the part: {problems[0]}")
    if "clearance" not in without:
        problems = check_rotation_clearance(plan)
        if problems:
            raise PlanError(f"{problems[0]} Make the part smaller with --size, or use a rig with more room.")
