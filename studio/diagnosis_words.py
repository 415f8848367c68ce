"""A diagnosis in words: why a crease stays short, what is proven, what was tried and what came of it."""

from __future__ import annotations

from typing import Any

from planner.diagnosis import Cure, Diagnosis, Proof
from planner.fold_plan import Blocked, FoldPlan
from studio.words import blocked_values, degrees

__all__ = [
    "best_cure_text",
    "blocked_summary",
    "cause_text",
    "cure_text",
    "diagnosis_values",
    "proof_text",
    "story",
]

_SHOWN = 10
"""Faces of a path that are named before the rest is left out."""


def story(plan: FoldPlan, blocked: Blocked) -> list[str]:
    """The whole story of one blocked crease, a line each; without a diagnosis just what the plan says."""
    head = f"crease {blocked.crease}: folded to {_angle(blocked.reached_rad)} of {_angle(blocked.wanted_rad)}"
    found = blocked.diagnosis
    if found is None:
        return [f"{head}, stopped by {blocked.by} (not looked into)"]
    lines = [
        f"{head}, which costs about {found.loss_mm:.2f} mm of shape",
        f"  cause: {cause_text(plan, blocked)}",
    ]
    if len(found.path_faces) > 1:
        lines.append(f"  path:  {_path(found)}")
    lines.append(f"  proof: {proof_text(found.proof)}")
    freeing = [cure for cure in found.cures if cure.frees]
    others = [cure for cure in found.cures if not cure.frees]
    before = f"now {_whole(plan.metrics.fold_completion, plan.metrics.shape_rms, len(plan.blocked))}"
    if freeing:
        lines.append(f"  frees it, folded again ({before}):")
        lines += [f"    - {cure_text(plan, cure)}" for cure in freeing]
    if others:
        lines.append("  tried, does not free it:")
        lines += [f"    - {cure_text(plan, cure)}" for cure in others]
    if found.tries == 0 and found.capped:
        lines.append(f"  cures were not looked for yet: blossom explain DIR {blocked.crease} does")
    elif not freeing:
        lines.append(
            "  no change that was tried frees it" + (", and not all were tried" if found.capped else "")
        )
    elif found.capped:
        lines.append("  not every change that is possible was tried")
    return lines


def cause_text(plan: FoldPlan, blocked: Blocked) -> str:
    """The cause in one line."""
    found = blocked.diagnosis
    assert found is not None  # noqa: S101 - asked only where there is one
    at = _angle(found.at_rad)
    own = plan.net.child_of[blocked.crease]
    if found.cause == "contact":
        return f"at {at} face {found.toucher} of the moving part touches face {found.blocker}"
    if found.cause == "substrate":
        return (
            f"at {at} face {found.toucher} touches triangle {found.blocker} of the sheet, which has to stay"
        )
    if found.cause == "order":
        return "nothing stops it where it stands; coming back to it would fold it"
    if found.cause == "room":
        return "left short on purpose: what it carries would be in the way of others"
    if found.cause == "own flap":
        return (
            f"its own face {own} leans over it at {at}: the beam would have to come from beyond the largest "
            f"tilt of {degrees(plan.limits.max_tilt_rad, 1):g}°"
        )
    who = f"face {found.blocker}" + (", which turns with it," if found.carried else "")
    text = f"{who} hides it from the beam at {at}"
    if found.views:
        best = found.views[-1]
        text += (
            f": under the best rotary angle, {_angle(best.rotary_rad)}, {100 * best.hidden:.0f} % are hidden"
        )
        straight = found.views[0]
        if straight.rotary_rad != best.rotary_rad:
            text += f"; straight it is seen up to {_angle(straight.to_rad)}"
    return text


def proof_text(proof: Proof | None) -> str:
    """What is proven, in one line."""
    if proof is None:
        return "none: no way was found, but none is ruled out"
    if proof.kind == "orders":
        return (
            "impossible with this net, base, axis and sheet: all outside-in orders were tried, each crease "
            f"as far as it goes ({proof.states} states, {proof.beams} rotary angles a side)"
        )
    bound = f"no beam within the tilt limit reaches a crease beyond {_angle(proof.bound_rad)}"
    if proof.kind == "angle":
        return f"impossible as a crease, whatever base, order and axis: {bound}"
    return f"impossible with the rotary axis along this direction of the net: {bound}"


def cure_text(plan: FoldPlan, cure: Cure) -> str:
    """What was changed and what came of it, in one line."""
    whole = _whole(cure.completion, cure.shape_rms, cure.blocked)
    reached = "" if cure.frees else f"it reaches {_angle(cure.reached_rad)}; "
    return f"{_change(plan, cure)}: {reached}{whole}"


def best_cure_text(plan: FoldPlan, blocked: Blocked) -> str:
    """The most useful cure that frees the crease in a few words; empty if none was found."""
    found = blocked.diagnosis
    if found is None or not found.cures or not found.cures[0].frees:
        return ""
    return cure_text(plan, found.cures[0])


def blocked_summary(plan: FoldPlan, blocked: Blocked) -> dict[str, Any]:
    """A blocked crease as plain values, with its cause and its best cure in words where they are known."""
    values = blocked_values(blocked)
    if blocked.diagnosis is None:
        return values
    proven = "" if blocked.diagnosis.proof is None else proof_text(blocked.diagnosis.proof)
    return values | {
        "cause": cause_text(plan, blocked),
        "proven": proven,
        "cure": best_cure_text(plan, blocked),
    }


def diagnosis_values(plan: FoldPlan, blocked: Blocked) -> dict[str, Any]:
    """A blocked crease and its diagnosis as plain values for JSON, with the story in words."""
    import msgspec

    from planner.diagnosis_file import diagnosis_record

    values = blocked_values(blocked)
    if blocked.diagnosis is not None:
        values["diagnosis"] = msgspec.to_builtins(diagnosis_record(blocked.diagnosis))
    return {**values, "story": story(plan, blocked)}


def _change(plan: FoldPlan, cure: Cure) -> str:
    limits = plan.limits
    match cure.kind:
        case "tilt":
            return f"tilt by up to {degrees(cure.value, 1):g}° (now {degrees(limits.max_tilt_rad, 1):g}°)"
        case "axis":
            return f"turn the rotary axis by {degrees(cure.value, 1):g}° in the net"
        case "base":
            return f"keep face {cure.face} still instead of face {plan.net.base_face} (--base {cure.face})"
        case "cut":
            return f"cut crease {cure.crease} and join faces {cure.join[0]} and {cure.join[1]} instead"
        case "clearance":
            return f"set the faces in by {cure.value:g} mm (now {limits.clearance:g} mm)"
        case "hidden":
            return f"let {100 * cure.value:g} % of a crease be hidden (now {100 * plan.hidden_max:g} %)"
        case "unfold":
            return f"fold crease {cure.crease} by {degrees(cure.value, 1):g}° less"
        case "restore":
            return "fold it all the way"


def _path(found: Diagnosis) -> str:
    """Faces and creases from one end of the witness to the other."""
    words = [f"face {found.path_faces[0]}"]
    words += [
        f"crease {crease} - face {face}"
        for crease, face in zip(found.path_creases, found.path_faces[1:], strict=True)
    ]
    if len(words) > _SHOWN:
        half = _SHOWN // 2
        words = [*words[:half], f"… {len(words) - 2 * half} more …", *words[-half:]]
    return " - ".join(words)


def _whole(completion: float, shape_rms: float, blocked: int) -> str:
    creases = "all creases fold" if blocked == 0 else f"{blocked} short"
    return f"{100 * completion:.1f} % folded, {shape_rms:.2f} mm rms, {creases}"


def _angle(angle_rad: float) -> str:
    return f"{degrees(angle_rad, 1):g}°"
