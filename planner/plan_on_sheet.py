"""One placed net in its sheet: folds with the sheet in place, what is clipped, what holds, all the steps."""

from __future__ import annotations

import math
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from planner.clearance import check_rotation_clearance
from planner.clip_regions import clip_region, clip_swept
from planner.corner_tabs import neck_notice
from planner.errors import PlanError
from planner.fabrication import check_held, fabrication_steps
from planner.fold_plan import Blocked, Fold, FoldPlan, PlanMetrics, Rotate, Sheet
from planner.fold_problem import BY_ORDER, HELD_BACK, FlatTree, FoldProblem, FoldResult
from planner.holding import Hold, hold_base
from planner.lost_folds import foldable_share
from planner.metal_pieces import incentres, piece_of
from planner.neck_contact import stays_clear
from planner.net import Net
from planner.sheet_hits import sheet_hits, sheet_solids
from planner.substrate import make_sheet
from planner.swept_region import swept_region
from planner.tab_strength import tab_notice

__all__ = ["MOST_PLANS", "SheetFold", "fold_on_sheet", "plan_on_sheet", "same_places", "tree_of_net"]

MOST_PLANS = 3
"""How often the folds are planned anew around what has to stay of the sheet, the first time included."""


def plan_on_sheet(
    net: Net,
    sheet: Sheet,
    problem: FoldProblem,
    seed: int,
    without: tuple[str, ...],
    notices: tuple[str, ...],
    folded: SheetFold | None = None,
) -> FoldPlan:
    """Fold the placed net with the frame and the hold of the base in the way, then add cuts and clips.

    Args:
        net: the net, placed.
        sheet: the sheet around it, without tabs; not looked at where ``folded`` is given.
        problem: goal, limits and rules.
        seed: recorded in the plan.
        without: rules that are switched off, recorded in the plan.
        notices: what the user should know, recorded in the plan.
        folded: what ``fold_on_sheet`` made of it, if that is known already.

    Raises:
        PlanError: if the base cannot be held, or the part cannot be turned.
    """
    limits = problem.limits
    folded = folded or fold_on_sheet(net, sheet, problem, without)
    sheet, result, hold, hits, kept = folded.sheet, folded.result, folded.hold, folded.hits, folded.kept
    if hold.needed and "held" not in without:
        raise PlanError(
            f"the base face {net.base_face} cannot be held: the folds sweep every way from it to the frame. "
            "Choose another base face (--base)"
        )
    swept_area = 0.0
    if hits:
        fitted = clip_swept(net, sheet, hold, hits, tree_of_net(net), result, problem)
        swept_area = fitted.swept_area
        kept = same_places(sheet, kept, fitted.sheet)
        sheet, hold, hits = fitted.sheet, fitted.hold, fitted.hits
    folds = fold_steps(net, result)
    steps = fabrication_steps(net, sheet, hold, folds, hits)
    plan = FoldPlan(
        net=net,
        sheet=replace(sheet, tabs=hold.tabs),
        limits=limits,
        steps=steps,
        metrics=replace(_metrics(net, sheet, hold, result), swept_area=swept_area),
        blocked=_blocked(net, result, kept),
        hidden_max=problem.hidden_max,
        without=without,
        seed=seed,
        notices=notices,
    )
    _check(plan, without)
    necks = neck_notice(net, hold.tabs, limits.kerf)
    return replace(plan, notices=(*notices, *necks, *tab_notice(plan)))


@dataclass(frozen=True, eq=False)
class SheetFold:
    """A net folded with its sheet in place.

    Attributes:
        sheet: the sheet; divided along what the folds sweep where only so a way to hold the base is left.
        result: what the fold planner reached.
        hold: what holds the base; ``hold.needed`` is empty unless it cannot be held.
        hits: substrate triangle that the folds sweep → number of the first fold that does.
        kept: (K,) substrate triangles that stay and stood in the way: obstacle k is triangle ``kept[k]``.
    """

    sheet: Sheet
    result: FoldResult
    hold: Hold
    hits: dict[int, int]
    kept: NDArray[np.int64]


def fold_on_sheet(
    net: Net,
    sheet: Sheet,
    problem: FoldProblem,
    without: Collection[str],
    after: NDArray[np.int64] | None = None,
    back: NDArray[np.float64] | None = None,
) -> SheetFold:
    """Fold the placed net around the frame and whatever has to stay so that the base is held.

    Args:
        net: the net, placed.
        sheet: the sheet around it; its tabs do not matter.
        problem: goal, limits and rules.
        without: rules that are switched off.
        after: (F,) for each face another whose crease is to be folded before, see ``FoldProblem.fold``.
        back: (F,) angle, rad, by which the crease of each face is held back on purpose.

    Raises:
        PlanError: if no free edge of the base panel has sheet beside it.
    """
    tree = tree_of_net(net)
    kept = np.flatnonzero(sheet.frame_faces)
    if "substrate" in without:
        result = problem.fold(tree, after=after, back=back, fine_sight=True)
        return SheetFold(sheet, result, hold_base(net, sheet, problem.limits, ()), {}, kept)
    for turn in range(MOST_PLANS):
        bodies = sheet_solids(sheet, problem.limits.thickness)
        result = problem.fold(tree, obstacles=bodies[kept], after=after, back=back, fine_sight=True)
        folded = _held(net, sheet, kept, tree, result, problem)
        if folded.hold.needed and turn == 0:
            folded = _on_divided_sheet(net, folded, tree, problem)
        if not folded.hold.needed:
            break
        sheet, stays = folded.sheet, sorted(folded.hold.tether | folded.hold.needed)
        kept = np.union1d(np.flatnonzero(sheet.frame_faces), np.array(stays, dtype=np.int64))
    return folded


def _held(
    net: Net,
    sheet: Sheet,
    kept: NDArray[np.int64],
    tree: FlatTree,
    result: FoldResult,
    problem: FoldProblem,
) -> SheetFold:
    """What is left of ``sheet`` to hold the base, with the folds of ``result``."""
    hits = sheet_hits(tree, result, problem, sheet_solids(sheet, problem.limits.thickness))
    swept = frozenset(hits) - frozenset(kept.tolist())
    check = partial(stays_clear, tree=tree, result=result, problem=problem)
    return SheetFold(sheet, result, hold_base(net, sheet, problem.limits, swept, check), hits, kept)


def _on_divided_sheet(net: Net, folded: SheetFold, tree: FlatTree, problem: FoldProblem) -> SheetFold:
    """The same folds on the sheet divided along what they sweep, if that can be done.

    A triangle that the folds touch anywhere is lost as a whole, and with it ways that they leave free.
    """
    import shapely

    sheet = folded.sheet
    polygons = shapely.polygons(sheet.triangles)
    frame = shapely.union_all(polygons[sheet.frame_faces], grid_size=1e-7)
    metal = shapely.union_all(polygons[~sheet.frame_faces], grid_size=1e-7)
    swept = swept_region(tree, folded.result, problem, rough=True)
    with suppress(PlanError, shapely.errors.GEOSException):
        finer = make_sheet(net, problem.limits, clip_region(swept, metal, frame, problem.limits))
        kept = same_places(sheet, folded.kept, finer)
        return _held(net, finer, kept, tree, folded.result, problem)
    return folded


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


def _metrics(net: Net, sheet: Sheet, hold: Hold, result: FoldResult) -> PlanMetrics:
    """Figures of the plan; energy and time are added when the process is known."""
    clipped = sorted(hold.clipped)
    a, b, c = (sheet.triangles[clipped, k] for k in range(3))
    area = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum()
    return PlanMetrics(
        fold_completion=result.completion * foldable_share(net),
        shape_rms=result.shape_rms,
        shape_rms_rel=result.shape_rms / float(np.linalg.norm(np.ptp(net.goal.vertices, axis=0))),
        rotations=result.rotations,
        clipped_faces=len(clipped),
        clipped_area=float(area),
    )


def same_places(sheet: Sheet, triangles: NDArray[np.int64], other: Sheet) -> NDArray[np.int64]:
    """For each of ``triangles`` of ``sheet`` the triangle of ``other`` around its middle."""
    import shapely

    return piece_of(shapely.polygons(other.triangles), incentres(sheet.triangles[triangles]))


def _blocked(net: Net, result: FoldResult, kept: NDArray[np.int64]) -> tuple[Blocked, ...]:
    """Creases that stay short of the goal, with what stops them."""
    out = []
    for face in np.flatnonzero(result.cause != 0).tolist():
        edge = int(net.crease_of[face])
        blocker = int(result.blocker[face])
        by: str = {2: "sight", BY_ORDER: "order", HELD_BACK: "room"}.get(int(result.cause[face]), "collision")
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
