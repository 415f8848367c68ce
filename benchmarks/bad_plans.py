"""Plans that must not pass: made from good ones, with what is wrong with each known exactly beforehand.

``python -m benchmarks.bad_plans MESH …`` plans each mesh, spoils the plan in four ways many times, and asks
the twin. What it should say comes from the planner's closed forms: rule and step, or the pair that touches
first with its angle. Printed is a Markdown table: caught of so many, the largest difference of an angle, and
how many of the good plans passed the whole validation.

wrong order    two folds change places, or one is moved
wrong side     the sheet lies the wrong way round when a crease is lit
over-fold      a crease turns on until it meets something, and 3 degrees beyond
missing clip   substrate that the folds sweep is left in place

Left out are spoilt plans that happen to be good, and those that only graze: whose contact is gone when every
solid is smaller by 0.02 % of its size.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from planner import make_net, plan_folds, read_goal
from planner.fold_plan import Clip, Fold, FoldPlan, MachineLimits, Rotate, Step
from planner.fold_replay import FoldReplay
from rigs.limits import machine_limits
from rigs.material import load_material
from rigs.rig import load_rig
from twin.events import Event
from twin.mjcf_model import compile_model
from twin.rule_check import rule_events
from twin.sweep import kinematic_sweep
from twin.validation import validate

KINDS = ("wrong order", "wrong side", "over-fold", "missing clip")
BOUND_RAD = math.radians(0.25)
"""The twin's angle of first contact may differ from the planner's exact one by this."""

BEYOND_RAD = math.radians(3.0)
_HAIR = 2e-4
"""Share of its size by which a solid is made smaller to tell a contact from a graze: 2 µm of 10 mm."""

_TIE_RAD = math.radians(0.02)
_LARGEST_RAD = math.radians(178.0)


@dataclass(frozen=True, eq=False)
class Exact:
    """What the planner's closed form says of the first contact of a plan.

    Attributes:
        step: plan step of the turn.
        pairs: pairs (faces sorted, substrate triangles) that meet first, ties included, with their angles.
    """

    step: int
    pairs: dict[tuple[tuple[int, ...], tuple[int, ...]], float]


@dataclass(frozen=True, eq=False)
class BadPlan:
    """A spoilt plan.

    Attributes:
        kind: one of ``KINDS``.
        plan: the plan.
        contact: its first contact, None if nothing touches.
        rule: (rule, step) of the first broken rule of the folds, None if none is.
    """

    kind: str
    plan: FoldPlan
    contact: Exact | None
    rule: tuple[str, int] | None


@dataclass
class Tally:
    """What came of plans of one kind.

    Attributes:
        plans: so many.
        caught: so many were refused for the right reason at the right step, with the right pair.
        worst_rad: largest difference of an angle of first contact from the exact one.
        misses: what went wrong, in words.
    """

    plans: int = 0
    caught: int = 0
    worst_rad: float = 0.0
    misses: list[str] = field(default_factory=list)


def first_contact(plan: FoldPlan, smaller: float = 0.0) -> Exact | None:
    """The planner's exact first contact of a plan played as it stands.

    Up to the first fold that breaks outside-in: the closed form holds for creases whose way to the base is
    flat.

    Args:
        plan: the plan.
        smaller: make every solid smaller by this share of its size, about its middle.
    """
    replay = FoldReplay(replace(plan, without=()))
    solids = replay.state.solids
    middle = solids.mean(axis=1, keepdims=True)
    solids[:] = middle + (1.0 - smaller) * (solids - middle)
    for number, step in enumerate(plan.steps):
        if isinstance(step, Fold):
            if replay.objection(step) == "outside-in":
                return None
            found = _contacts_of_turn(replay, step)
            if found:
                return Exact(number, found)
        replay.make(step)
    return None


def _contacts_of_turn(replay: FoldReplay, fold: Fold) -> dict[tuple[tuple[int, ...], tuple[int, ...]], float]:
    """Pairs that meet first, with the fold angle at which they do; pairs within a hair of it too."""
    state = replay.copy().state
    face, count = replay.plan.net.child_of[fold.crease], len(replay.plan.net.faces)
    found: dict[tuple[tuple[int, ...], tuple[int, ...]], float] = {}
    first = math.inf
    while True:
        hit = state.contact(face, fold.to_rad)
        if hit.still < 0 or hit.free_rad > first + _TIE_RAD:
            return found
        first = min(first, hit.free_rad)
        at = float(state.angle[face]) + math.copysign(hit.free_rad, fold.to_rad - state.angle[face])
        pair = (
            ((hit.moving,), (hit.still - count,))
            if hit.still >= count
            else (tuple(sorted((hit.moving, hit.still))), ())
        )
        found[pair] = at
        state.present[hit.still] = False


def first_broken_rule(plan: FoldPlan) -> tuple[str, int] | None:
    """The first fold that the planner's own rules of order and side forbid: (rule, step)."""
    replay = FoldReplay(replace(plan, without=("sight", "contact", "substrate")))
    for number, step in enumerate(plan.steps):
        if isinstance(step, Fold):
            rule = replay.objection(step)
            if rule:
                return rule, number
        replay.make(step)
    return None


def bad_plans(plan: FoldPlan, each: int, seed: int) -> Iterator[BadPlan]:
    """Up to ``each`` spoilt plans of every kind; fewer where a plan offers fewer chances."""
    for kind, spoil in (
        ("wrong order", _wrong_order), ("wrong side", _wrong_side), ("over-fold", _over_fold),
        ("missing clip", _missing_clip),
    ):  # fmt: skip
        rng = np.random.default_rng((seed, KINDS.index(kind)))
        made, seen = 0, set()
        for _ in range(12 * each):
            if made >= each:
                break
            steps = spoil(plan, rng)
            if steps is None or steps in seen:
                continue
            seen.add(steps)
            spoilt = replace(plan, steps=steps, without=())
            bad = BadPlan(kind, spoilt, first_contact(spoilt), first_broken_rule(spoilt))
            if bad.contact is None and bad.rule is None:
                continue  # it happens to be as good as before
            if bad.contact is not None and _only_grazes(spoilt, bad.contact):
                continue
            made += 1
            yield bad


def _only_grazes(plan: FoldPlan, exact: Exact) -> bool:
    """Is the contact gone, or in another step, when all solids are a hair smaller?

    Walls that slide along each other at a distance of exactly 0 meet or do not meet by rounding alone.
    """
    again = first_contact(plan, _HAIR)
    return again is None or again.step != exact.step


def _places(plan: FoldPlan) -> list[int]:
    return [n for n, s in enumerate(plan.steps) if isinstance(s, Fold)]


def _rotary_at(plan: FoldPlan) -> dict[int, float]:
    """Step of each fold → rotary angle."""
    rotary, out = 0.0, {}
    for number, step in enumerate(plan.steps):
        if isinstance(step, Rotate):
            rotary = step.to_rad
        elif isinstance(step, Fold):
            out[number] = rotary
    return out


def _with_folds(plan: FoldPlan, folds: Sequence[tuple[Fold, float]]) -> tuple[Step, ...]:
    """The plan with its folds replaced in their places by (fold, rotary angle), lit from their own sides."""
    out: list[Step] = []
    rotary, following = 0.0, iter(folds)
    for step in plan.steps:
        if isinstance(step, Rotate):
            continue
        if isinstance(step, Fold):
            fold, wanted = next(following)
            if wanted != rotary:
                out.append(Rotate(wanted))
                rotary = wanted
            out.append(fold)
        else:
            out.append(step)
    return tuple(out)


def _wrong_order(plan: FoldPlan, rng: np.random.Generator) -> tuple[Step, ...] | None:
    places = _places(plan)
    if len(places) < 2:
        return None
    rotary = _rotary_at(plan)
    folds = [(plan.steps[n], rotary[n]) for n in places]
    i, j = rng.choice(len(folds), 2, replace=False).tolist()
    if rng.random() < 0.5:
        folds[i], folds[j] = folds[j], folds[i]
    else:
        folds.insert(j, folds.pop(i))
    return _with_folds(plan, folds)  # type: ignore[arg-type]  # they are folds


def _wrong_side(plan: FoldPlan, rng: np.random.Generator) -> tuple[Step, ...] | None:
    places = _places(plan)
    if not places:
        return None
    rotary = _rotary_at(plan)
    wrong = int(rng.choice(places))
    folds = [(plan.steps[n], rotary[n] + (np.pi if n == wrong else 0.0)) for n in places]
    return _with_folds(plan, folds)  # type: ignore[arg-type]


def _over_fold(plan: FoldPlan, rng: np.random.Generator) -> tuple[Step, ...] | None:
    places = _places(plan)
    if not places:
        return None
    number = int(rng.choice(places))
    fold = plan.steps[number]
    assert isinstance(fold, Fold)
    far = replace(fold, to_rad=math.copysign(_LARGEST_RAD, fold.to_rad))
    replay = FoldReplay(replace(plan, without=()))
    for step in plan.steps[:number]:
        replay.make(step)
    met = _contacts_of_turn(replay, far)
    if not met:
        return None
    at = min(met.values(), key=abs)
    to_rad = math.copysign(min(abs(at) + BEYOND_RAD, _LARGEST_RAD), fold.to_rad)
    if abs(to_rad) < abs(at) + 0.5 * BEYOND_RAD:
        return None
    return (*plan.steps[:number], replace(fold, to_rad=to_rad), *plan.steps[number + 1 :])


def _missing_clip(plan: FoldPlan, rng: np.random.Generator) -> tuple[Step, ...] | None:
    clips = [n for n, s in enumerate(plan.steps) if isinstance(s, Clip)]
    if not clips:
        return None
    number = int(rng.choice(clips))
    clip = plan.steps[number]
    assert isinstance(clip, Clip)
    left = rng.random(len(clip.faces)) < rng.choice([0.05, 0.3, 1.0])
    kept = tuple(f for f, stays in zip(clip.faces, left.tolist(), strict=True) if not stays)
    new: tuple[Step, ...] = (Clip(kept),) if kept else ()
    return (*plan.steps[:number], *new, *plan.steps[number + 1 :])


def judged(bad: BadPlan) -> tuple[list[str], float]:
    """What the twin says wrongly of a spoilt plan (nothing if it is caught), and the difference in angle."""
    compiled = compile_model(bad.plan)
    contacts = kinematic_sweep(compiled, bad.plan).events
    broken = rule_events(bad.plan)
    wrong, difference = [], 0.0
    if bad.rule is not None:
        rule, step = bad.rule
        first = next((e for e in broken if e.rule in ("outside-in", "side")), None)
        if not any((e.rule, e.step) == (rule, step) for e in broken) or first is None or first.step != step:
            said = "nothing" if first is None else f"{first.rule} at step {first.step}"
            wrong.append(f"{rule} at step {step}: the twin says {said}")
    elif any(e.rule in ("outside-in", "side", "tilt") for e in broken):
        wrong.append(f"no rule of a fold is broken, but the twin says {broken[0].detail}")
    if bad.contact is not None:
        difference = _compare_contact(bad.contact, contacts, wrong)
    else:
        # Beyond a fold that breaks outside-in the closed form says nothing: the twin may see a contact there.
        until = bad.rule[1] if bad.rule is not None and bad.rule[0] == "outside-in" else len(bad.plan.steps)
        if contacts and contacts[0].step < until:
            wrong.append(
                f"nothing touches, but the twin says {contacts[0].detail} in step {contacts[0].step}"
            )
    return wrong, difference


def _compare_contact(exact: Exact, contacts: Sequence[Event], wrong: list[str]) -> float:
    """Difference of the angles of the pair that meets first, rad; adds what is wrong to ``wrong``."""
    told = f"{', '.join(map(str, exact.pairs))} in step {exact.step}"
    if not contacts:
        wrong.append(f"{told}: the twin sees no contact")
        return 0.0
    first = contacts[0]
    if first.step != exact.step:
        wrong.append(f"{told}: the twin's first contact is {first.detail} in step {first.step}")
        return 0.0
    # Pairs that meet within a hair of each other may come in another order.
    seen = {e.pair: e.angle_rad for e in reversed(contacts) if e.step == exact.step}
    common = [pair for pair in exact.pairs if pair in seen]
    if not common:
        wrong.append(f"{told}: the twin names {first.detail}")
        return 0.0
    angle = min(exact.pairs.values(), key=abs)
    difference = max(abs(first.angle_rad - angle), min(abs(seen[p] - exact.pairs[p]) for p in common))
    if difference > BOUND_RAD:
        wrong.append(f"{told}: exact {math.degrees(angle):.3f}°, the twin: {first.detail}")
    return difference


def tally(plans: Sequence[BadPlan]) -> dict[str, Tally]:
    """What came of spoilt plans, by kind."""
    out = {kind: Tally() for kind in KINDS}
    for bad in plans:
        one = out[bad.kind]
        wrong, difference = judged(bad)
        one.plans += 1
        one.caught += not wrong
        one.worst_rad = max(one.worst_rad, difference)
        one.misses += wrong
    return out


def the_limits(rig: str = "grbl-4axis", material: str = "304", thickness_mm: float = 0.1) -> MachineLimits:
    """Limits of a shipped rig and material."""
    return machine_limits(load_rig(rig), load_material(material), thickness_mm)


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line of the benchmark; exit code 1 if anything was missed or a good plan refused."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--each", type=int, default=12, help="spoilt plans of each kind and mesh")
    parser.add_argument("--budget", type=float, default=20.0, help="nominal seconds of planning")
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args(arguments)
    limits = the_limits()
    total = {kind: Tally() for kind in KINDS}
    print("| net | faces | " + " | ".join(KINDS) + " | largest difference ° | good plan | s |")
    print("|---|---|" + "---|" * (len(KINDS) + 3))
    refused = 0
    for path in chosen.meshes:
        began = time.process_time()
        plan = plan_folds(make_net(read_goal(path)), limits, budget_s=chosen.budget, seed=chosen.seed)
        good = validate(plan, draws=1).verdict
        refused += good != "pass"
        found = tally(list(bad_plans(plan, chosen.each, chosen.seed)))
        worst = max(t.worst_rad for t in found.values())
        cells = [f"{found[k].caught} of {found[k].plans}" for k in KINDS]
        print(
            f"| {path.stem} | {len(plan.net.faces)} | " + " | ".join(cells)
            + f" | {math.degrees(worst):.3f} | {good} | {time.process_time() - began:.0f} |",
            flush=True,
        )  # fmt: skip
        for kind, one in found.items():
            total[kind].plans += one.plans
            total[kind].caught += one.caught
            total[kind].misses += [f"{path.stem}, {kind}: {text}" for text in one.misses]
    plans, caught = (sum(getattr(t, name) for t in total.values()) for name in ("plans", "caught"))
    sums = [f"{total[k].caught} of {total[k].plans}" for k in KINDS]
    good = f"{len(chosen.meshes) - refused} of {len(chosen.meshes)} pass"
    print(f"| **all** | | {' | '.join(sums)} | | {good} | |\n")
    print(f"{caught} of {plans} bad plans caught; {refused} false alarms on {len(chosen.meshes)} good plans")
    misses = [text for one in total.values() for text in one.misses]
    for text in misses:
        print(f"- {text}")
    return 1 if misses or refused else 0


if __name__ == "__main__":
    raise SystemExit(main())
