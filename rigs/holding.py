"""Held and going on: the feed stands, the light is off, and only a person's word lets it go on.

A machine is held on request (``Holding.request``), by its door, or by somebody else's hold. ``~`` is sent
only after a person said so; in front of an armed machine that was held for long, whose door was open or that
was held by something else, the person has to arm it again, as at the beginning.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from rigs.arming import DRIFT_S, Arming
from rigs.controller import Controller
from rigs.errors import JobError, MachineError
from rigs.grbl import Status
from rigs.journal import JournalWriter
from rigs.listener import state_words

__all__ = ["Held", "Holder", "Holding"]

_BRAKES_S = 2.0
_RESTORES_S = 10.0
_LOOK_S = 0.02
_ON_REQUEST = "on request"


@dataclass(frozen=True)
class Held:
    """A machine that stands held, as it is told to the person who decides.

    Attributes:
        reason: why it was held, in words.
        state: what the controller reports, such as ``Hold:0``.
        block: index of the block under way, -1 at the head or tail of the program.
        step: its plan step.
        lid_open: the door must be closed before it can go on.
        emulated: True when no real machine is involved.
    """

    reason: str
    state: str
    block: int
    step: int
    lid_open: bool
    emulated: bool

    @property
    def words(self) -> str:
        """The same in words."""
        machine = "EMULATED machine" if self.emulated else "REAL MACHINE"
        lid = "; close the lid first" if self.lid_open else ""
        return f"{machine} held in block {self.block} (step {self.step}), {self.reason}: it is dark{lid}"


@dataclass
class Holding:
    """How a replay can be held, and who lets it go on.

    Attributes:
        go_on: called once the machine stands; True lets it go on, False stops the job. It is called again
            while the lid is still open.
        arm_again: called with the question of the first arming where the armed state has lapsed meanwhile.
        request: set it from anywhere to hold the machine; it is cleared when the machine goes on.
    """

    go_on: Callable[[Held], bool]
    arm_again: Callable[[str], bool] | None = None
    request: threading.Event = field(default_factory=threading.Event)


class Holder:
    """Holds the machine of one replay.

    Args:
        controller: of the machine.
        journal: gets a record when it is held and one when it goes on.
        holding: who decides.
        arming: the armed state, None for a replay without light.
        arm: asks for the first arming again; raises where it is not given.
        emulated: True when no real machine is involved.
        where: block and step under way.
        clock: seconds of the replay, for the journal.
    """

    def __init__(
        self,
        controller: Controller,
        journal: JournalWriter,
        holding: Holding,
        arming: Arming | None,
        arm: Callable[[], None],
        *,
        emulated: bool,
        where: Callable[[], tuple[int, int]],
        clock: Callable[[], float],
    ) -> None:
        self.controller, self.journal, self.holding = controller, journal, holding
        self.arming, self.arm, self.emulated = arming, arm, emulated
        self.where, self.clock = where, clock
        self.seconds = 0.0

    def hold(self) -> None:
        """Hold now, ask, and go on when a person said so.

        Raises:
            JobError: if the person does not let it go on, or does not arm it again.
            MachineError: if the machine does not stand, or does not go on.
        """
        start = time.monotonic()
        gate = self.controller.gate
        level = gate.level
        requested = self.holding.request.is_set() and self.controller.holds is None
        brakes = self.controller.rig.controller.dialect != "marlin"
        gate.hold(brakes=brakes and self.controller.holds is None)
        status = self._standing() if brakes else self.controller.status_aside()
        reason = _ON_REQUEST if requested else _by_itself(status)
        block, step = self.where()
        self.journal.write(
            "held",
            sync=True,
            block=block,
            step=step,
            reason=reason,
            state=state_words(status),
            t=self.clock(),
        )
        door = self._asked(status, reason, brakes=brakes)
        lapsed = self._lapsed(time.monotonic() - start, door=door, requested=requested)
        if lapsed and level == "armed" and not self.emulated:
            self.arm()
        if self.arming is not None:
            self.arming.renew()
        held = time.monotonic() - start
        self.journal.write(
            "released",
            sync=True,
            block=block,
            step=step,
            held_s=round(held, 3),
            lapsed=lapsed,
            t=self.clock(),
        )
        self.holding.request.clear()
        self.controller.holds = None
        gate.level = level
        if brakes:
            gate.go_on()
            self._moving()
        self.seconds += time.monotonic() - start

    def _asked(self, status: Status, reason: str, *, brakes: bool) -> bool:
        """Ask until it can go on; True if the door was open meanwhile."""
        door = False
        while True:
            door = door or status.state == "Door"
            is_open = status.state == "Door" and status.substate == 1
            block, step = self.where()
            held = Held(reason, state_words(status), block, step, is_open, self.emulated)
            if not self.holding.go_on(held):
                raise JobError(
                    f"stopped while held in block {block} (step {step}): go on with 'blossom resume'"
                )
            status = self.controller.status_aside()
            if brakes and status.state not in ("Hold", "Door"):
                raise MachineError(
                    f"the machine left the hold by itself, it reports {state_words(status)}: "
                    "something else steers it"
                )
            if not (status.state == "Door" and status.substate == 1):
                return door or status.state == "Door"

    def _lapsed(self, seconds: float, *, door: bool, requested: bool) -> str:
        """Why the armed state has lapsed, in words; empty if it has not."""
        limit = self.controller.rig.safety.arm_timeout_s
        if door:
            return "the door was open"
        if not requested:
            return "it was not held by this program"
        if seconds > limit:
            return f"it was held for longer than {limit:g} s"
        if self.arming is not None and abs(self.arming.drift()) > DRIFT_S:
            return "the clock jumped"
        return ""

    def _standing(self) -> Status:
        """The first status that shows the machine braked to a stand."""
        deadline = time.monotonic() + _BRAKES_S
        while True:
            status = self.controller.status_aside()
            if status.state == "Door" and status.substate != 2:
                return status
            if status.state == "Hold" and status.substate != 1:
                return status
            if time.monotonic() > deadline:
                raise MachineError(f"the machine should be held now, it reports {state_words(status)}")
            time.sleep(_LOOK_S)

    def _moving(self) -> None:
        """Wait until the hold is over; a firmware may take seconds to restore the laser after the door."""
        deadline = time.monotonic() + _RESTORES_S
        while True:
            status = self.controller.status_aside()
            if status.state not in ("Hold", "Door"):
                return
            if time.monotonic() > deadline:
                raise MachineError(f"the machine does not go on, it reports {state_words(status)}")
            time.sleep(_LOOK_S)


def _by_itself(status: Status) -> str:
    return "by its door" if status.state == "Door" else "by its own button or another sender"
