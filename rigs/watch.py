"""What may look over the shoulder of a replay, and what may steer it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Protocol

from rigs.grbl import Status
from rigs.replay_blocks import ReplayBlock

__all__ = ["Steering", "Watch", "Watches"]


class Watch(Protocol):
    """Sees every block and every status report; an exception stops the machine.

    All times are seconds since the first block.
    """

    def begins(self, block: ReplayBlock, seconds: float, t: float) -> None:
        """A block is about to be sent; it should take ``seconds``."""

    def reports(self, status: Status, place: Mapping[str, float], t: float) -> None:
        """The machine says where it is (work coordinates by axis word)."""

    def confirmed(self, block: ReplayBlock, place: Mapping[str, float], t: float) -> None:
        """A block was executed; the machine stands at ``place``."""


class Watches:
    """Several watches as one."""

    def __init__(self, *watches: Watch) -> None:
        self.watches = watches

    def begins(self, block: ReplayBlock, seconds: float, t: float) -> None:
        """Tell all of them."""
        for watch in self.watches:
            watch.begins(block, seconds, t)

    def reports(self, status: Status, place: Mapping[str, float], t: float) -> None:
        """Tell all of them."""
        for watch in self.watches:
            watch.reports(status, place, t)

    def confirmed(self, block: ReplayBlock, place: Mapping[str, float], t: float) -> None:
        """Tell all of them."""
        for watch in self.watches:
            watch.confirmed(block, place, t)


class Steering(Protocol):
    """Says what is made in place of a block of the job.

    Attributes:
        note: writes a record into the journal, as ``JournalWriter.write`` does; the replay sets it.
    """

    note: Callable[..., None] | None

    def blocks_for(self, block: ReplayBlock) -> Iterator[ReplayBlock]:
        """Blocks to send when ``block`` is due; each is asked for after the one before was confirmed."""
