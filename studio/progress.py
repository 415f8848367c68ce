"""Progress of long work: a live line with an estimate on a terminal, plain lines when piped, or nothing."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID

__all__ = ["Progress", "duration_text"]

PLAIN_INTERVAL_S = 5.0
"""Piped output gets a line at most this often within one stage."""

VERBOSE_INTERVAL_S = 1.0
"""The same where more was asked for."""


def duration_text(seconds: float) -> str:
    """A duration as people say it: ``0.4 s``, ``12 s``, ``3 min 05 s``, ``2 h 04 min``."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


class Progress:
    """Tells on ``stream`` which stage runs and how far it is; collects how long each stage took.

    With ``verbose`` it also says what was written, and how far it is every second when piped.

    Attributes:
        seconds: wall-clock seconds per finished stage (they go to ``timing.json``, nowhere else).
    """

    def __init__(self, *, quiet: bool = False, verbose: bool = False, stream: TextIO | None = None) -> None:
        self.stream = sys.stderr if stream is None else stream
        self.quiet = quiet
        self.verbose = verbose and not quiet
        self.live = not quiet and self.stream.isatty()
        self.seconds: dict[str, float] = {}
        self._stage = ""
        self._start = 0.0
        self._last_line = 0.0
        self._last_share = 0.0
        self._bar: RichProgress | None = None
        self._task: TaskID | None = None

    @contextmanager
    def stage(self, name: str, doing: str) -> Iterator[None]:
        """Run one stage: ``name`` is its short name, ``doing`` says in words what happens."""
        self._stage, self._start = name, time.monotonic()
        self._last_line, self._last_share = self._start, 0.0
        if self.live:
            self._open_bar(doing)
        done = False
        try:
            yield
            done = True
        finally:
            took = time.monotonic() - self._start
            self.seconds[name] = self.seconds.get(name, 0.0) + took
            if self._bar is not None:
                self._bar.stop()
                self._bar, self._task = None, None
            if not self.quiet and done:
                print(f"{name:<9}{doing}: {duration_text(took)}", file=self.stream, flush=True)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Leave the terminal to a question while the block runs."""
        if self._bar is not None:
            self._bar.stop()
        try:
            yield
        finally:
            if self._bar is not None:
                self._bar.start()

    def update(self, share: float, text: str = "") -> None:
        """Tell how much of the running stage is done.

        Args:
            share: 0 to 1.
            text: what it is at, in a few words.
        """
        share = min(max(float(share), 0.0), 1.0)
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=share, detail=text)
            return
        now = time.monotonic()
        if self.quiet or now - self._last_line < (VERBOSE_INTERVAL_S if self.verbose else PLAIN_INTERVAL_S):
            return
        self._last_line = now
        left = (now - self._start) * (1.0 - share) / share if 0.02 < share < 1.0 else None
        estimate = f", about {duration_text(left)} left" if left is not None else ""
        detail = f" {text}" if text else ""
        print(f"{self._stage:<9}{100 * share:3.0f} %{detail}{estimate}", file=self.stream, flush=True)

    def note(self, text: str) -> None:
        """A line that the user should see, also when piped; not shown with ``--quiet``."""
        if self.quiet:
            return
        if self._bar is not None:
            self._bar.console.print(text, highlight=False, markup=False)
        else:
            print(text, file=self.stream, flush=True)

    def detail(self, text: str) -> None:
        """A line for those who asked for more."""
        if self.verbose:
            self.note(text)

    def _open_bar(self, doing: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
        from rich.progress import Progress as RichProgress

        self._bar = RichProgress(
            SpinnerColumn(), TextColumn(f"{self._stage:<8}"), TextColumn("{task.description}"),
            BarColumn(bar_width=24), TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(),
            TextColumn("{task.fields[detail]}"),
            console=Console(file=self.stream), transient=True,
        )  # fmt: skip
        self._task = self._bar.add_task(doing, total=1.0, detail="")
        self._bar.start()
