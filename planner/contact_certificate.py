"""Certificates of contact: every turn of a finished plan, proven free or with the pairs that are not.

The proof replays the folds from the plan alone and shares no code with the search for first contacts; see
``planner/_kernels/certificate_kernels.py`` for how it goes and what it allows for rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from planner.errors import PlanError
from planner.fold_plan import Bend, Clip, Fold, FoldPlan
from planner.fold_problem import FoldProblem
from planner.insets import edge_insets
from planner.plan_on_sheet import tree_of_net
from planner.sheet_hits import sheet_solids

__all__ = ["ENOUGH_MM", "ContactCertificate", "OpenPair", "TurnProof", "certify_contact"]

ENOUGH_MM = 0.5
"""Distances are told up to this one: what is farther apart is not looked at closely."""

TOUCH_RAD = 1e-3
"""A pair that stays open only this near to the goal angle touches at the goal."""

_MOST_OPEN_PAIRS = 4096


@dataclass(frozen=True)
class OpenPair:
    """A pair of solids that was not proven free.

    Attributes:
        moving: face of the net that turns.
        still: face of the net, or triangle of the substrate, that stands still.
        in_substrate: ``still`` is a triangle of the substrate.
        kind: ``touching`` if it is open only within ``TOUCH_RAD`` of the goal angle of the crease, where two
            faces may meet; ``contact`` if the solids were found to overlap; else ``undecided``.
        from_rad: first fold angle of the crease that is open.
        to_rad: last fold angle that is open.
    """

    moving: int
    still: int
    in_substrate: bool
    kind: Literal["touching", "undecided", "contact"]
    from_rad: float
    to_rad: float


@dataclass(frozen=True)
class TurnProof:
    """What is proven of one turn.

    Attributes:
        step: index of the step in the plan.
        crease: net edge that turns.
        from_rad: fold angle before the turn.
        to_rad: fold angle after it.
        margin_mm: every pair that is not in ``open_pairs`` keeps at least this distance all the time; at most
            ``ENOUGH_MM``.
        pairs: pairs of a moving and a still solid.
        close_pairs: those of them that needed separating planes.
        intervals: angle intervals that were looked at for these.
        open_pairs: pairs that are not proven free.
    """

    step: int
    crease: int
    from_rad: float
    to_rad: float
    margin_mm: float
    pairs: int
    close_pairs: int
    intervals: int
    open_pairs: tuple[OpenPair, ...] = ()

    @property
    def is_free(self) -> bool:
        """True if no pair is open."""
        return not self.open_pairs

    @property
    def touches_at_goal(self) -> bool:
        """True if pairs are open, and all of them only where the crease reaches its goal angle."""
        return bool(self.open_pairs) and all(pair.kind == "touching" for pair in self.open_pairs)


@dataclass(frozen=True)
class ContactCertificate:
    """What is proven of all turns of a plan.

    Attributes:
        turns: one entry per fold step, in order.
        error_mm: bound of the error of any coordinate in the replay; the margins allow for it.
    """

    turns: tuple[TurnProof, ...]
    error_mm: float

    @property
    def free_turns(self) -> int:
        """How many turns are proven free."""
        return sum(turn.is_free for turn in self.turns)

    @property
    def is_proven(self) -> bool:
        """True if every turn is proven free, or touches at its goal angle only."""
        return all(turn.is_free or turn.touches_at_goal for turn in self.turns)

    @property
    def margin_mm(self) -> float:
        """Least proven distance over all turns, at most ``ENOUGH_MM``."""
        return min((turn.margin_mm for turn in self.turns), default=ENOUGH_MM)

    def words(self) -> str:
        """The result in one line."""
        count = len(self.turns)
        text = f"{self.free_turns} of {count} turns certified free"
        if self.free_turns:
            free = min(turn.margin_mm for turn in self.turns if turn.is_free)
            text += (
                f", at least {_two_digits(free)} mm apart"
                if free < ENOUGH_MM
                else f", more than {ENOUGH_MM:g} mm apart"
            )
        touching = sum(turn.touches_at_goal for turn in self.turns)
        if touching:
            text += f"; {touching} touch at the goal angle"
        left = count - self.free_turns - touching
        if left:
            first = next(turn for turn in self.turns if not (turn.is_free or turn.touches_at_goal))
            pair = next(pair for pair in first.open_pairs if pair.kind != "touching")
            other = f"{'substrate triangle' if pair.in_substrate else 'face'} {pair.still}"
            text += (
                f"; {left} not proven, first step {first.step}: face {pair.moving} and {other} "
                f"({pair.kind}, from {np.degrees(pair.from_rad):.2f} degrees)"
            )
        return text


def _two_digits(length_mm: float) -> str:
    """A length rounded down to two digits that count."""
    if length_mm <= 0.0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(length_mm)) - 1)
    return f"{math.floor(length_mm / unit) * unit:.2g}"


def certify_contact(plan: FoldPlan) -> ContactCertificate:
    """Prove, turn by turn, that nothing touches while ``plan`` is folded.

    The solids are those that the planner keeps apart: every face a prism as thick as the sheet, its walls set
    in (``planner.insets``), with the plainly inset middle triangle of faces too slim for their mitre; and the
    triangles of the substrate that are there when the step begins. The two faces at the turning crease are
    one piece of metal and make no pair. Tabs lie within the kerf and are no solids.

    Args:
        plan: a finished plan, such as ``read_plan`` returns; its rules and metrics are not looked at.

    Raises:
        PlanError: if the plan bends substrate, which this proof does not cover.
    """
    from planner._kernels.certificate_kernels import certify_folds

    net, limits = plan.net, plan.limits
    insets = edge_insets(net, limits.thickness, limits.clearance)
    problem = FoldProblem(net.goal, insets, limits)
    tree = tree_of_net(net)
    bodies = sheet_solids(plan.sheet, limits.thickness)
    solids = np.ascontiguousarray(np.concatenate([problem.solids(tree), bodies])[:, :9])
    sharp = np.concatenate([problem.sharp, np.zeros(len(bodies), np.bool_)])
    numbers, folds, before, until = _folds(plan, len(solids))
    rows = np.arange(len(net.faces))
    hinges = np.zeros((len(net.faces), 2, 3))
    hinges[:, 0, :2] = tree.corners[rows, tree.slot]
    hinges[:, 1, :2] = tree.corners[rows, (tree.slot + 1) % 3]
    results, pairs = np.zeros((len(folds), 4)), np.zeros((_MOST_OPEN_PAIRS, 6))
    count, error = certify_folds(
        solids, sharp, until, hinges, tree.parent, *tree.subtrees, folds,
        ENOUGH_MM, results, pairs,
    )  # fmt: skip
    if count > _MOST_OPEN_PAIRS:
        raise PlanError(
            f"{count} pairs of solids are not free of contact, more than any plan of this program leaves; "
            "does the plan belong to this net?"
        )
    turns = []
    for number, (step, old, row) in enumerate(zip(numbers, before, results.tolist(), strict=True)):
        fold = plan.steps[step]
        assert isinstance(fold, Fold)  # noqa: S101 - ``numbers`` are those of the folds
        mine = pairs[:count][pairs[:count, 0] == number]
        turns.append(
            TurnProof(
                step=step, crease=fold.crease, from_rad=old, to_rad=fold.to_rad, margin_mm=row[0],
                pairs=int(row[1]), close_pairs=int(row[2]), intervals=int(row[3]),
                open_pairs=tuple(_open_pair(plan, fold, old, pair) for pair in mine),
            )
        )  # fmt: skip
    return ContactCertificate(tuple(turns), float(error))


def _folds(
    plan: FoldPlan, total: int
) -> tuple[list[int], NDArray[np.float64], list[float], NDArray[np.int64]]:
    """Steps that fold, (M, 2) face and turn of each, angle before; (total,) fold that a solid is gone by."""
    numbers: list[int] = []
    folds: list[tuple[float, float]] = []
    before: list[float] = []
    until = np.full(total, len(plan.steps), dtype=np.int64)
    angles = np.zeros(len(plan.net.edges))
    for number, step in enumerate(plan.steps):
        match step:
            case Fold(crease=crease, to_rad=to_rad):
                old = float(angles[crease])
                if to_rad == old:
                    continue
                numbers.append(number)
                before.append(old)
                folds.append((plan.net.child_of[crease], to_rad - old))
                angles[crease] = to_rad
            case Clip(faces=faces):
                gone = len(plan.net.faces) + np.array(faces, dtype=np.int64)
                until[gone] = np.minimum(until[gone], len(folds))
            case Bend():
                raise PlanError(
                    f"step {number} bends the substrate, which no certificate covers; "
                    "plan again without bends, or leave out --certify"
                )
            case _:
                pass
    return numbers, np.array(folds).reshape(-1, 2), before, until


def _open_pair(plan: FoldPlan, fold: Fold, old: float, row: NDArray[np.float64]) -> OpenPair:
    """A row of the kernel in words of the plan."""
    from planner._kernels.certificate_kernels import CONTACT

    _, moving, still, state, lo, hi = row.tolist()
    faces = len(plan.net.faces)
    sign = 1.0 if fold.to_rad > old else -1.0
    wanted = float(plan.net.fold_angle[fold.crease])
    kind: Any = "contact" if int(state) == CONTACT else "undecided"
    at_goal = abs(fold.to_rad - wanted) < 1e-6 and abs(fold.to_rad - old) - lo < TOUCH_RAD
    if at_goal:
        kind = "touching"
    is_sheet = int(still) >= faces
    return OpenPair(
        moving=int(moving),
        still=int(still) - faces if is_sheet else int(still),
        in_substrate=is_sheet,
        kind=kind,
        from_rad=old + sign * lo,
        to_rad=old + sign * hi,
    )
