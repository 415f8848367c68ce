"""Signals that end a replay, and the short time in which they must not."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType

__all__ = ["deaf_to_signals", "hold_signal", "stop_signals"]


@contextlib.contextmanager
def stop_signals() -> Iterator[None]:
    """SIGTERM, and a terminal that goes away, end a replay as Ctrl-C does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(_signum: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = {number: signal.signal(number, stop) for number in _stops() if number != signal.SIGINT}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def hold_signal(request: threading.Event) -> Iterator[None]:
    """Ctrl-Z (SIGTSTP) asks for a hold instead of stopping this program while the machine goes on."""
    number = getattr(signal, "SIGTSTP", None)
    if number is None or threading.current_thread() is not threading.main_thread():
        yield
        return

    def hold(_signum: int, _frame: FrameType | None) -> None:
        request.set()

    before = signal.signal(number, hold)
    try:
        yield
    finally:
        signal.signal(number, before)


def _stops() -> list[signal.Signals]:
    """Signals that end a replay; one that the caller ignores, as under nohup, goes on being ignored."""
    hang_up = getattr(signal, "SIGHUP", None)
    numbers = [signal.SIGINT, signal.SIGTERM]
    return numbers + ([hang_up] if hang_up and signal.getsignal(hang_up) != signal.SIG_IGN else [])


@contextlib.contextmanager
def deaf_to_signals() -> Iterator[None]:
    """A second Ctrl-C must not cut the stop short; it takes half a second at most."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, signal.SIG_IGN) for number in _stops()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
