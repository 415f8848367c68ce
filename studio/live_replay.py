"""A running machine and its twin side by side in the live view."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from studio.live_stand import Stand
from studio.plan_moment import moment_at

if TYPE_CHECKING:
    from rigs.grbl import Status
    from rigs.job import Job
    from rigs.replay import Progress as Position
    from rigs.replay_blocks import ReplayBlock
    from studio.workspace import Workspace
    from twin.workpiece import Workpiece

__all__ = ["ReplayView"]

EVERY_S = 0.1
"""The page is drawn again at most so often."""

BANNERS = {
    None: ("#7a5000", "the machine has not answered yet"),
    True: ("#0b66c3", "EMULATED machine: no laser, no metal"),
    False: ("#b3005e", "REAL machine"),
}
"""Colour and words of the banner; what the machine is, it says itself."""


class ReplayView:
    """A ``rigs.watch.Watch`` that only looks: on the left the machine, on the right the plan in the twin.

    The machine's head and rotary are where its status reports say. Its part is folded by confirmed passes,
    as the process predicts them; without light it stays flat. The twin's part is the plan at the step that is
    under way. Whatever goes wrong in the view is told once and ends the view, never the machine.

    Attributes:
        machine: stand of the machine.
        twin: stand of the twin.
        broken: what went wrong in the view; empty while it works.
    """

    def __init__(
        self, server: Any, ws: Workspace, job: Job, part: Workpiece, *, lit: bool, mode: str,  # noqa: ANN401  viser
        tell: Callable[[str], None],
    ) -> None:  # fmt: skip
        self.plan, self.rig, self.job, self.part = ws.plan, ws.rig, job, part
        self.lit, self.mode, self.tell = lit, mode, tell
        self.broken = ""
        self._step, self._shown_at = -1, -math.inf
        self._counts: dict[int, int] = {}
        for block in job.blocks:
            self._counts[block.step] = self._counts.get(block.step, 0) + 1
        self._done: dict[int, int] = {}
        self._place: Mapping[str, float] = {}
        radius = 0.5 * float(np.linalg.norm(np.ptp(ws.plan.sheet.outline, axis=0)))
        self.machine = Stand(server.scene, "machine", ws.plan, -1.15 * radius)
        self.twin = Stand(server.scene, "twin", ws.plan, 1.15 * radius)
        self.machine.label.text, self.twin.label.text = "machine: confirmed passes", "twin: the plan"
        server.initial_camera.position = (0.0, -3.4 * radius, 2.4 * radius)
        server.initial_camera.look_at = (0.0, 0.0, 0.0)
        self.banner = server.gui.add_html("")
        self.text = server.gui.add_markdown("")
        self.emulated: bool | None = None
        self._say(None)

    def begins(self, block: ReplayBlock, seconds: float, t: float) -> None:
        """A block is about to be sent."""
        del seconds, t
        if block.step >= 0:
            self._step = block.step

    def reports(self, status: Status, place: Mapping[str, float], t: float) -> None:
        """The machine says where it is."""
        del t
        self._guarded(lambda: self._follow(place, beam=status.s > 0.0 and self.mode != "dry-run"))

    def confirmed(self, block: ReplayBlock, place: Mapping[str, float], t: float) -> None:
        """A block was executed: a confirmed pass folds its crease."""
        del t
        self._guarded(lambda: self._count(block))
        self._guarded(lambda: self._follow(place, beam=False))

    def progress(self, at: Position) -> None:
        """The replay says how far it is, and what the machine is."""
        self._guarded(lambda: self._progress(at))

    def finish(self) -> None:
        """Draw the last state, whenever the page was drawn before."""
        self._shown_at = -math.inf
        self._guarded(self._draw)
        self._guarded(lambda: self.machine.light(None))

    def _count(self, block: ReplayBlock) -> None:
        if not 0 <= block.index < len(self.job.blocks):
            return
        made = self.job.blocks[block.index]
        if made.kind == "pass" and self.lit:
            self.part.heat(made.path[0], made.path[-1], made.rotary_rad, made.power_w, made.speed_mm_s)
        self._done[made.step] = self._done.get(made.step, 0) + 1

    def _progress(self, at: Position) -> None:
        if at.emulated is not self.emulated:
            self._say(at.emulated)
        if self._is_due() or at.block == at.blocks:
            self.text.content = f"{self.mode}, block {at.block} of {at.blocks}\n\n{self._step_words()}"

    def _step_words(self) -> str:
        if self._step < 0:
            return ""
        return f"step {self._step + 1}: {moment_at(self.plan, self._step + 0.5).text}"

    def _say(self, emulated: bool | None) -> None:
        self.emulated = emulated
        colour, words = BANNERS[emulated]
        self.banner.content = (
            f'<div style="background:{colour};color:#fff;font-weight:700;padding:8px 12px">{words}</div>'
        )

    def _follow(self, place: Mapping[str, float], *, beam: bool) -> None:
        self._place = place
        if not self._is_due():
            return
        axis = self.rig.rotary
        x0, y0, _ = axis.axis_point_mm
        head = np.array([place.get("X", math.nan) - x0, place.get("Y", math.nan) - y0, 0.0])
        self._draw()
        self.machine.light(head if beam and np.isfinite(head).all() else None)

    def _draw(self) -> None:
        self._shown_at = time.monotonic()
        axis = self.rig.rotary
        turned = self._place.get(axis.word, math.nan) / (axis.units_per_deg * axis.sign)
        if math.isfinite(turned):
            self.machine.turn(math.radians(turned))
        whole = max(self._counts.get(self._step, 1), 1)
        moment = moment_at(self.plan, self._step + min(self._done.get(self._step, 0) / whole, 1.0))
        self.twin.show(moment)
        self.machine.fold(self.part.angles_of_net())
        if self.lit:
            self.machine.lay(moment.gone, moment.bent, released=moment.released)

    def _is_due(self) -> bool:
        return time.monotonic() - self._shown_at >= EVERY_S

    def _guarded(self, work: Callable[[], None]) -> None:
        if self.broken:
            return
        try:
            work()
        except Exception as error:  # noqa: BLE001  a picture must never stop a machine that runs
            self.broken = str(error) or type(error).__name__
            self.tell(f"the live view ended ({self.broken}); the machine goes on")
