"""Random changes of a candidate: another axis, base or order, or one crease cut and joined elsewhere."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.flat_layout import FlatLayout
from planner.fold_problem import FlatTree, FoldResult
from planner.own_sight import OwnSight

__all__ = ["OwnLimit", "Trial", "movers", "random_trial"]

AXIS_SHARE, BASE_SHARE, ORDER_SHARE, ANYWHERE_SHARE = 0.1, 0.1, 0.12, 0.13
"""Shares of the moves that turn the rotary axis, take another base face, fold in another order, or exchange a
crease anywhere instead of between two faces that block each other."""

MEND_WARM = 0.003
"""Temperature at which mending starts, in cost."""

DROP_SHARE = 0.3
"""Share of the moves of the order that drop a wish."""

BACK_SHARE, RELEASE_SHARE = 0.25, 0.4
"""Share of the exchanges in place of which a crease is held back, so that what it carries is less in the way
of another; and how many of these let one go further again, if there are any."""

MOST_BACK_RAD, BACK_FOLDS = math.radians(30.0), 4.0
"""How much a crease is held back at once: at most, and at least, as the power of e by which that is less."""

AXIS_STEP_RAD = 0.2
"""Typical turn of the rotary axis in a small move."""

CUTS_TRIED, JOINS_TRIED = 3, 12

MEND_SHARE, LEAST_OWN, FEWEST_MENDS, MOST_MENDS = 0.2, 1e-4, 50, 400
"""Share of the moves that mend what own sight misses, where that is more than the least cost, by so many
changes that own sight alone judges."""

OWN_TRIES, OTHER_TRIES = 60, 8
"""Exchanges, and other moves, that are tried until one is within the limit of ``OwnSight``."""

EASY_FOLD_RAD, SHARP_FOLD_RAD = math.radians(50.0), math.radians(25.0)
"""Folds up to the first angle are all alike; sharper ones are joined e times less often for each second."""


@dataclass(frozen=True, eq=False)
class Trial:
    """What is to be judged next.

    Attributes:
        layout: the net.
        axis_rad: direction of the rotary axis, from the base face's side from corner 0 to corner 1.
        after: (F,) for each face another whose crease is to be folded before, -1: none; None: none at all.
        own: cost of the net as ``OwnSight`` sees it; 0 if nobody asked.
        back: (M,) angle, rad, by which the crease at each interior edge of the goal is held back, so that
            others go further; None: none is.
    """

    layout: FlatLayout
    axis_rad: float
    after: NDArray[np.int64] | None
    own: float = 0.0
    back: NDArray[np.float64] | None = None


@dataclass(frozen=True, eq=False)
class OwnLimit:
    """What ``OwnSight`` must say of the next net: nets that are beyond it are not worth a plan.

    Attributes:
        sight: the table.
        cost: largest cost.
    """

    sight: OwnSight
    cost: float


def random_trial(
    now: Trial,
    tree: FlatTree,
    result: FoldResult,
    rng: np.random.Generator,
    axes: list[float],
    *,
    fixed_base: bool,
    fixed_net: bool = False,
    own: OwnLimit | None = None,
) -> Trial | None:
    """One random change of ``now``, driven by what did not fold; None if none was possible.

    Args:
        now: the candidate.
        tree: its net as plain arrays.
        result: how far it folds.
        rng: of the choice.
        axes: directions of the rotary axis to jump to.
        fixed_base: keep the base face.
        fixed_net: keep the whole net; only the axis and the order change.
        own: nets beyond it are passed over; None: no limit.
    """
    if own is not None and not fixed_net and now.own > LEAST_OWN and rng.random() < MEND_SHARE:
        return _mended(now, own, rng, fixed_base=fixed_base)
    kind = rng.random()
    if fixed_net:
        kind *= AXIS_SHARE + ORDER_SHARE
        kind += BASE_SHARE if kind >= AXIS_SHARE else 0.0
    if kind < AXIS_SHARE:
        return _within(lambda: _other_axis(now, axes, rng), own)
    kind -= AXIS_SHARE
    if kind < BASE_SHARE and not (fixed_base or fixed_net):
        return _within(lambda: _other_base(now, rng), own)
    missing = np.abs(tree.target) - np.minimum(np.abs(result.reached), np.abs(tree.target))
    failed = np.flatnonzero((result.cause != 0) & (missing > 1e-9))
    if len(failed) == 0:
        return None
    weight = missing[failed] + 0.05
    face = int(rng.choice(failed, p=weight / weight.sum()))
    other = int(result.blocker[face])
    if not 0 <= other < len(tree.parent):
        other = face
    kind -= BASE_SHARE
    if kind < ORDER_SHARE:
        return _other_order(now, face, other, rng)
    kind -= ORDER_SHARE
    if rng.random() < BACK_SHARE:
        return _held_back(now, face, other, rng)
    return _exchange(now, face, other, rng, anywhere=kind < ANYWHERE_SHARE, own=own)


def _mended(now: Trial, own: OwnLimit, rng: np.random.Generator, *, fixed_base: bool) -> Trial | None:
    """A net near by that misses less by own sight, a few exchanges away; None if none was found."""
    moves = int(rng.integers(FEWEST_MENDS, MOST_MENDS))
    made = own.sight.anneal(now.layout, now.axis_rad, moves, rng, fixed_base=fixed_base, warm=MEND_WARM)
    if made.cost >= now.own or made.cost > own.cost:
        return None
    return replace(now, layout=made.layout, axis_rad=made.axis_rad, own=made.cost)


def _within(make: Callable[[], Trial | None], own: OwnLimit | None) -> Trial | None:
    """The first trial made that is within the limit; None if none of a few is."""
    if own is None:
        return make()
    for _ in range(OTHER_TRIES):
        trial = make()
        if trial is not None:
            cost, _ = own.sight.cost(trial.layout, trial.axis_rad)
            if cost <= own.cost:
                return replace(trial, own=cost)
    return None


def _other_axis(now: Trial, axes: list[float], rng: np.random.Generator) -> Trial:
    """The rotary axis in another direction, near by or one of ``axes``."""
    jump = rng.random() < 0.4
    angle = axes[int(rng.integers(len(axes)))] if jump else now.axis_rad + AXIS_STEP_RAD * rng.normal()
    return replace(now, axis_rad=float(angle))


def _other_base(now: Trial, rng: np.random.Generator) -> Trial | None:
    """The base moved to a neighbour or to any face, if that can be held."""
    layout = now.layout.copy()
    before = layout.heading
    faces = layout.graph.faces
    beside = faces[(faces == layout.base).any(axis=1)].ravel()
    beside = beside[beside != layout.base]
    near = rng.random() < 0.5 and len(beside) > 0
    layout.set_base(int(rng.choice(beside)) if near else int(rng.integers(len(layout.parent))))
    axis_rad = now.axis_rad + before - layout.heading  # it stays where it is in the net
    return replace(now, layout=layout, axis_rad=axis_rad) if layout.free_edges() > 0 else None


def _other_order(now: Trial, face: int, other: int, rng: np.random.Generator) -> Trial | None:
    """What blocks a failed face is folded after it; or one such wish is dropped."""
    layout = now.layout
    after = np.full(len(layout.parent), -1) if now.after is None else now.after.copy()
    wishes = np.flatnonzero(after >= 0)
    if len(wishes) and rng.random() < DROP_SHARE:
        after[rng.choice(wishes)] = -1
        return replace(now, after=after)
    carriers, common = movers(layout, face, other)
    if not carriers or common == face:
        return None  # what hangs on the face turns before it in any case
    after[rng.choice(carriers)] = face
    return replace(now, after=after)


def _held_back(now: Trial, face: int, other: int, rng: np.random.Generator) -> Trial | None:
    """A crease that moves what blocks a failed face is held back by an angle; or one goes further again."""
    layout = now.layout
    back = np.zeros(len(layout.tree)) if now.back is None else now.back.copy()
    held = np.flatnonzero((back > 0.0) & layout.tree)
    if len(held) and rng.random() < RELEASE_SHARE:
        back[rng.choice(held)] *= max(0.0, 2.0 * rng.random() - 1.0)
        return replace(now, back=back)
    carriers = [f for f in movers(layout, face, other)[0] if not layout.graph.flat[layout.crease[f]]]
    if not carriers:
        return None
    back[layout.crease[rng.choice(carriers)]] += MOST_BACK_RAD * math.exp(-BACK_FOLDS * rng.random())
    return replace(now, back=back)


def movers(layout: FlatLayout, face: int, other: int) -> tuple[list[int], int]:
    """Faces whose creases move ``other`` but not ``face``, and the face where their ways to the base meet."""
    above, up = set(), face
    while up >= 0:
        above.add(up)
        up = int(layout.parent[up])
    found = []
    while other not in above:
        found.append(other)
        other = int(layout.parent[other])
    return found, other


def _exchange(
    now: Trial, face: int, other: int, rng: np.random.Generator, *, anywhere: bool, own: OwnLimit | None
) -> Trial | None:
    """A crease on the way between two faces is cut, and the parts are joined at another edge."""
    layout = now.layout.copy()
    crease = int(layout.crease[face])
    path = [crease, crease]
    if anywhere:
        path = np.flatnonzero(layout.tree).tolist()
    elif other != face:
        path = [crease, *layout.path(face, other).tolist()]
    cuttable = [edge for edge in path if not layout.graph.flat[edge]]
    if own is not None:
        cost = own.sight.exchange(
            layout, now.axis_rad, np.array(cuttable, dtype=np.int64), own.cost, OWN_TRIES, rng
        )
        return None if cost is None else replace(now, layout=layout, own=cost)
    rng.shuffle(cuttable)
    for cut in cuttable[:CUTS_TRIED]:
        joins = layout.joinable(cut)
        for join in _gentle_first(joins[joins != cut], layout, rng)[:JOINS_TRIED].tolist():
            if layout.exchange(cut, join):
                return replace(now, layout=layout)
    return None


def _gentle_first(
    edges: NDArray[np.int64], layout: FlatLayout, rng: np.random.Generator
) -> NDArray[np.int64]:
    """``edges`` in random order, those that fold sharply less often in front.

    Sharp folds are shown to their end by few tilts, if any, and what hangs on them covers the rest.
    """
    sharp = np.maximum(0.0, np.abs(layout.graph.fold_angle[edges]) - EASY_FOLD_RAD) / SHARP_FOLD_RAD
    return edges[np.argsort(sharp - rng.gumbel(size=len(edges)), kind="stable")]
