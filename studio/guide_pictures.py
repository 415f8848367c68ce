"""Pictures of a plan for the guide: one at the end of each stretch of work under one rotary angle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from planner.fold_plan import Clip, Cut, Fold, Release, Rotate
from studio.words import degrees

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from planner.fold_plan import FoldPlan
    from studio.film import Moment
    from studio.report_steps import StepSetting
    from studio.workspace import Workspace

__all__ = ["MOST_PICTURES", "Stretch", "pictures", "stretches"]

MOST_PICTURES = 8


@dataclass(frozen=True)
class Stretch:
    """Steps that run one after the other under one rotary angle.

    Attributes:
        first: index of its first step.
        last: index of its last step.
        rotary_deg: angle of the rotary.
        cuts: cut steps in it.
        clips: pieces of the sheet that fall.
        creases: creases that turn, each once, in order.
        passes: fold passes.
        seconds: planned duration.
        released: whether the part is cut free in it.
    """

    first: int
    last: int
    rotary_deg: float
    cuts: int
    clips: int
    creases: tuple[int, ...]
    passes: int
    seconds: float
    released: bool

    def __add__(self, other: Stretch) -> Stretch:
        """Two stretches that follow one another as one; it has the rotary angle of the later one."""
        return Stretch(
            self.first, other.last, other.rotary_deg, self.cuts + other.cuts, self.clips + other.clips,
            tuple(dict.fromkeys((*self.creases, *other.creases))), self.passes + other.passes,
            self.seconds + other.seconds, self.released or other.released,
        )  # fmt: skip


def stretches(
    plan: FoldPlan, settings: Mapping[int, StepSetting], most: int = MOST_PICTURES
) -> list[Stretch]:
    """What the machine does, in at most ``most`` stretches.

    A stretch begins where the rotary turns or where the part is cut free. While there are too many, the two
    neighbours that together hold the fewest creases become one; the first (flat) and the last (free) stay.

    Args:
        plan: the plan.
        settings: step index → how it is burnt.
        most: largest number of stretches, at least 3.
    """
    from planner.metal_pieces import clipped_pieces

    out: list[Stretch] = []
    rotary = 0.0
    begin = 0
    cuts = clips = passes = 0
    seconds = 0.0
    creases: list[int] = []
    released = False

    def close(last: int) -> None:
        nonlocal begin, cuts, clips, passes, seconds, creases, released
        if cuts or clips or creases or released:
            found = tuple(dict.fromkeys(creases))
            out.append(Stretch(begin, last, rotary, cuts, clips, found, passes, seconds, released))
            begin, cuts, clips, passes, seconds, creases, released = last + 1, 0, 0, 0, 0.0, [], False

    for number, step in enumerate(plan.steps):
        turning = isinstance(step, Rotate | Release)
        if turning or (isinstance(step, Fold) and not creases and (cuts or clips)):
            close(number - 1)
        setting = settings.get(number)
        if setting is not None:
            passes += (setting.passes or 0) if isinstance(step, Fold) else 0
            seconds += setting.seconds or 0.0
        match step:
            case Rotate(to_rad=to):
                rotary = degrees(to, 1)
            case Cut():
                cuts += 1
            case Clip(faces=faces):
                clips += len(clipped_pieces(plan.sheet, set(faces)))
            case Fold(crease=crease):
                creases.append(crease)
            case Release():
                released = True
            case _:
                pass
    close(len(plan.steps) - 1)
    while len(out) > max(most, 3):
        inner = range(1, len(out) - 2)
        at = min(inner, key=lambda i: len(out[i].creases) + len(out[i + 1].creases))
        out[at : at + 2] = [out[at] + out[at + 1]]
    return out


def pictures(
    ws: Workspace, chosen: list[Stretch], width: int = 560, height: int = 420
) -> list[NDArray[np.uint8]]:
    """(H, W, 3) picture at the end of each stretch, by MuJoCo's renderer.

    Raises:
        RenderError: if there is no way to draw here.
    """
    from studio.film import Stage, choose_gl, moments

    choose_gl()
    from twin.mjcf_model import compile_model
    from twin.validation import sheet_metal

    compiled = compile_model(ws.plan, sheet_metal(ws.material))
    after: dict[int, Moment] = {}
    for moment in moments(ws.plan, compiled, 0.0):
        after[moment.step] = moment
    out = []
    with Stage(ws.plan, compiled, width, height) as stage:
        for number, stretch in enumerate(chosen, 1):
            at = max(step for step in after if step <= stretch.last)
            out.append(stage.picture(after[at]))
            ws.progress.update(number / len(chosen), f"picture {number} of {len(chosen)}")
    return out
