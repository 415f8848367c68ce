"""The live view of a bundle: its plan, or a replay that runs."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

from studio.live_server import live_server, url_of
from studio.workspace import Workspace

if TYPE_CHECKING:
    from rigs.grbl import Status
    from rigs.job import Job
    from rigs.replay_blocks import ReplayBlock
    from rigs.watch import Watch
    from studio.live_replay import ReplayView
    from twin.workpiece import Workpiece

__all__ = ["replay_view", "view_plan", "watched"]


def view_plan(ws: Workspace, port: int, *, say: Callable[[str], None], goes_on: Callable[[], bool]) -> None:
    """Serve the plan of a bundle until ``goes_on`` says no or Ctrl-C.

    Raises:
        BundleError: if there is no plan yet.
        ViewError: if there can be no view.
    """
    from studio.live_plan import PlanView

    plan = ws.plan
    with live_server(f"{ws.goal.name} – Metal Blossom", port) as server:
        view = PlanView(server, plan)
        say(url_of(server))
        view.run(goes_on)


@contextlib.contextmanager
def replay_view(
    ws: Workspace, job: Job, mode: str, port: int | None, part: Workpiece | None = None
) -> Iterator[ReplayView | None]:
    """A view of a replay while the block runs; None if ``port`` is None.

    The part is flat at first, unless ``part`` is given. On a terminal the view stays open after the replay
    until Enter is pressed.

    Raises:
        ViewError: if there can be no view; nothing was sent to the machine yet.
    """
    if port is None:
        yield None
        return
    from dataclasses import replace

    from studio.gauges import workpiece_of
    from studio.live_replay import ReplayView

    with live_server(f"{ws.goal.name} – replay – Metal Blossom", port) as server:
        view = ReplayView(
            server,
            ws,
            job,
            replace(part) if part else workpiece_of(ws),
            lit=mode == "arm",
            mode=mode,
            tell=ws.progress.note,
        )
        ws.progress.note(f"live view: {url_of(server)}")
        try:
            yield view
        finally:
            view.finish()
        if sys.stdin.isatty() and not ws.progress.quiet:
            sys.stderr.write("Press Enter to close the live view. ")
            sys.stderr.flush()
            sys.stdin.readline()


class _Both:
    """Two watches as one; the first comes first."""

    def __init__(self, first: Watch, second: Watch) -> None:
        self.both = (first, second)

    def begins(self, block: ReplayBlock, seconds: float, t: float) -> None:
        for watch in self.both:
            watch.begins(block, seconds, t)

    def reports(self, status: Status, place: Mapping[str, float], t: float) -> None:
        for watch in self.both:
            watch.reports(status, place, t)

    def confirmed(self, block: ReplayBlock, place: Mapping[str, float], t: float) -> None:
        for watch in self.both:
            watch.confirmed(block, place, t)


def watched(watch: Watch | None, seen: ReplayView | None) -> Watch | None:
    """What looks at a replay, the view last."""
    if watch is None or seen is None:
        return seen if watch is None else watch
    return _Both(watch, seen)
