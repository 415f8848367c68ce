"""Sending dark lines ahead: as many as the receive buffer of the controller holds, answers counted.

Only a dry run is sent this way. What is in the buffers of a controller is executed even when the host is
gone: that is harmless without light, and with light it is not (``rigs.replay_run`` sends blocks with light
one by one). Every line passes the gate, whose level lets no light through.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence

from rigs.controller import Controller
from rigs.errors import MachineError
from rigs.grbl import error_text, read_answer
from rigs.replay_blocks import ReplayBlock

__all__ = ["KEPT_BYTES", "send_ahead", "stretches"]

KEPT_BYTES = 8
"""Bytes of the receive buffer that stay free, for a line in work."""

_STRETCH_S = 10.0
_ALONE = ("rotate", "ask")
_LOOK_S = 0.05


def stretches(blocks: Sequence[ReplayBlock]) -> Iterator[tuple[ReplayBlock, ...]]:
    """Blocks that are sent without a stop between them; after each stretch the position is checked.

    A turn of the sheet and a question stand alone, others go together for about 10 s of planned time.
    """
    together: list[ReplayBlock] = []
    seconds = 0.0
    for block in blocks:
        if together and (block.kind in _ALONE or seconds >= _STRETCH_S):
            yield tuple(together)
            together, seconds = [], 0.0
        together.append(block)
        seconds += block.seconds
        if block.kind in _ALONE:
            yield tuple(together)
            together, seconds = [], 0.0
    if together:
        yield tuple(together)


def send_ahead(
    controller: Controller,
    lines: Sequence[str],
    seconds: float,
    grace_s: float,
    taken: Callable[[int], None],
) -> None:
    """Send lines within the receive buffer and wait until each is answered ``ok``.

    Args:
        controller: its gate must be at a level without light.
        lines: the last one must be answered only when the motion has ended.
        seconds: how long they should take at most.
        grace_s: how much longer than that may pass without an answer before one counts as missing.
        taken: told how many lines have been answered, after every one.

    Raises:
        MachineError: on errors, alarms, resets, silence, missing and superfluous answers; it names the line.
    """
    got = 0

    def told(count: int) -> None:
        nonlocal got
        got = count
        taken(count)

    controller.hear_out()
    controller.obey()
    controller.running = True
    try:
        _talk(controller, lines, 1.1 * seconds + grace_s, told)
    except MachineError as error:
        line = lines[got] if got < len(lines) else lines[-1]
        if line not in error.message:
            raise MachineError(f"{error.message}; the line under way was '{line}'") from error
        raise
    finally:
        controller.running = False


def _talk(
    controller: Controller, lines: Sequence[str], patience_s: float, taken: Callable[[int], None]
) -> None:
    room = controller.rig.controller.rx_bytes - KEPT_BYTES
    lost_s = controller.rig.safety.status_lost_s
    period = 1.0 / controller.rig.safety.status_hz
    sent = got = flying = 0
    heard = moved = time.monotonic()
    next_ask, asked = heard + period, None
    while got < len(lines):
        first = sent
        while sent < len(lines) and flying + len(lines[sent]) + 1 <= room:
            flying += len(lines[sent]) + 1
            sent += 1
        if sent > first:
            controller.gate.send(lines[first:sent])
        line = controller.read(0.0)
        now = time.monotonic()
        if line is None:
            lost = controller.held()
            moved, now = moved + lost, now + lost
            controller.check_times(now, moved, heard, asked, patience_s, len(lines) - got)
            if now >= next_ask:
                controller.gate.ask_status()
                asked = now if asked is None else asked
                next_ask = now + period
            line = controller.read(max(min(next_ask - now, _LOOK_S), 0.001))
        if line is None:
            continue
        heard = controller.heard
        answer = read_answer(line)
        kind = controller.note(answer)
        if kind == "ok":
            if got == sent:
                raise MachineError(
                    "the controller sent an 'ok' too many: bytes were lost or doubled on the way"
                )
            flying -= len(lines[got]) + 1
            got += 1
            moved = heard
            taken(got)
        elif kind == "error":
            raise MachineError(
                f"the controller answered {answer.text} to '{lines[got]}': {error_text(answer.code)}"
            )
        elif kind == "other":
            raise MachineError(f"answer not understood: {answer.text[:60]!a}: bytes were lost on the way")
        elif kind == "status":
            asked = None
            still = controller.status is not None and controller.status.state == "Idle"
            if still and got < sent and heard - moved > lost_s:
                raise MachineError(
                    f"{sent - got} answers are missing, and the machine stands idle: "
                    "bytes were lost on the way"
                )
