"""Scrubbing through a plan in the live view."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from studio.live_stand import Stand
from studio.plan_moment import moment_at

if TYPE_CHECKING:
    from planner.fold_plan import FoldPlan

__all__ = ["PlanView"]

FRAME_S = 0.05
STEPS_PER_S = 1.2


class PlanView:
    """A plan in a live view, with a slider, steps and play.

    Attributes:
        stand: what is shown.
        slider: the moment, in steps.
        playing: whether it runs by itself.
    """

    def __init__(self, server: Any, plan: FoldPlan) -> None:  # noqa: ANN401  viser
        self.plan = plan
        self.stand = Stand(server.scene, "plan", plan)
        far = 2.4 * self.stand.radius_mm
        server.initial_camera.position = (0.55 * far, -0.75 * far, 0.6 * far)
        server.initial_camera.look_at = (0.0, 0.0, 0.0)
        gui, end = server.gui, float(len(plan.steps))
        self.text = gui.add_markdown("")
        self.slider = gui.add_slider("step", min=0.0, max=end, step=0.01, initial_value=0.0)
        self.back, self.on = gui.add_button("one step back"), gui.add_button("one step on")
        self.playing = gui.add_checkbox("play", initial_value=False)
        self.speed = gui.add_slider("speed", min=0.25, max=30.0, step=0.25, initial_value=1.0)
        self.slider.on_update(lambda _event: self.show(float(self.slider.value)))
        self.back.on_click(lambda _event: self._step(-1))
        self.on.on_click(lambda _event: self._step(1))
        self.show(0.0)

    def show(self, moment: float) -> None:
        """Show a moment."""
        now = moment_at(self.plan, moment)
        self.stand.show(now)
        number = min(int(now.time + 0.999), len(self.plan.steps))
        self.text.content = f"**{now.text}**\n\nstep {number} of {len(self.plan.steps)}"

    def _step(self, by: int) -> None:
        now = float(self.slider.value)
        whole = math.floor(now + 1e-6) + 1 if by > 0 else math.ceil(now - 1e-6) - 1
        self.slider.value = float(min(max(whole, 0), len(self.plan.steps)))

    def run(self, goes_on: Callable[[], bool] = lambda: True) -> None:
        """Play where asked to, until ``goes_on`` says no or Ctrl-C."""
        while goes_on():
            time.sleep(FRAME_S)
            if not self.playing.value:
                continue
            end = float(len(self.plan.steps))
            now = float(self.slider.value)
            self.slider.value = (
                0.0 if now >= end else min(end, now + FRAME_S * STEPS_PER_S * self.speed.value)
            )
            if self.slider.value >= end:
                self.playing.value = False
