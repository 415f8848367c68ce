"""The armed state: given by a person, and lapsing by itself when nobody has watched over it."""

from __future__ import annotations

import time
from collections.abc import Callable

from rigs.errors import JobError

__all__ = ["DRIFT_S", "GAP_S", "Arming"]

GAP_S = 5.0
"""Longest time for which an armed host may not listen to the machine, unless it asks a person."""

DRIFT_S = 2.0
"""How far the clocks may go apart: more means that the computer slept."""


class Arming:
    """Leave to fire. It lapses when the host stood still, and when clocks jump, as after the computer slept.

    Args:
        monotonic: clock that never jumps; on most systems it stands still while the computer sleeps.
        wall: clock that goes on meanwhile.
    """

    def __init__(
        self, monotonic: Callable[[], float] = time.monotonic, wall: Callable[[], float] = time.time
    ) -> None:
        self._monotonic, self._wall = monotonic, wall
        self.renew()

    def renew(self) -> None:
        """A person acted: the time up to now is accounted for."""
        self._looked = self._monotonic()
        self._apart = self._wall() - self._looked
        self._longest = 0.0

    def look(self) -> None:
        """The host listens to the machine just now."""
        now = self._monotonic()
        self._longest = max(self._longest, now - self._looked)
        self._looked = now

    def drift(self) -> float:
        """Seconds by which the clocks went apart since a person last acted."""
        return self._wall() - self._monotonic() - self._apart

    def check(self) -> None:
        """Refuse to fire where the armed state has lapsed.

        Raises:
            JobError: saying why.
        """
        self.look()
        if self._longest > GAP_S:
            raise JobError(
                f"no longer armed: this program stood still for {self._longest:.0f} s (was it stopped?): "
                "go on with 'blossom resume'"
            )
        drift = self.drift()
        if abs(drift) > DRIFT_S:
            raise JobError(
                f"no longer armed: the clock jumped by {drift:+.0f} s (did the computer sleep?): "
                "go on with 'blossom resume'"
            )
