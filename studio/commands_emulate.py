"""``blossom emulate``: the product's own machine, and a bad cable to it, for programs that send."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from studio.commands_lists import say
from studio.commands_view import check_port
from studio.exit_codes import DONE
from studio.flags import not_negative

__all__ = ["emulate"]


def _free_or_port(kind: object, value: int | None) -> None:
    """Refuse what is neither 0 nor a port that a program of a user may open."""
    check_port(kind, value or None)


def emulate(
    rig: str = "grbl-4axis",
    /,
    *,
    port: Annotated[
        int,
        Parameter(metavar="N", validator=_free_or_port, help="Port on 127.0.0.1; 0 takes a free one."),
    ] = 0,
    time_scale: Annotated[
        float,
        Parameter(
            metavar="X",
            validator=not_negative,
            help="Simulated seconds in a second; 0: as fast as possible.",
        ),
    ] = 1.0,
    baud: Annotated[
        int,
        Parameter(
            metavar="N",
            validator=not_negative,
            help="Pace the link as a serial line, such as 115200; 0: at once.",
        ),
    ] = 0,
    fault: Annotated[
        tuple[str, ...], Parameter(metavar="FAULT", help="What goes wrong: error:9@120, door@2.5s, …")
    ] = (),
    cable: Annotated[
        tuple[str, ...],
        Parameter(metavar="HARM|FILE", help="A bad cable: cut@out300, drop@in12, delay:0.04@out0, …"),
    ] = (),
    trace: Annotated[Path | None, Parameter(metavar="FILE", help="Keep what the machine did.")] = None,
) -> int:
    """Run the emulated machine, with a bad cable to it if you like. No laser, no metal; 127.0.0.1 only.

    Prints the URL to connect to. Ctrl-C ends it.

    Examples:
        blossom emulate --port 4000 --baud 115200

        blossom emulate grbl-4axis --cable cut@out300 --cable delay:0.02@in0
    """
    from rigs.cable import cable as bad_cable
    from rigs.cable import read_cable
    from rigs.emulator import start_emulator
    from rigs.emulator.faults import read_faults
    from rigs.rig import load_rig

    load_rig(rig)
    read_faults(fault)
    harms = read_cable(cable)
    with contextlib.ExitStack() as stack:
        machine = stack.enter_context(
            start_emulator(
                rig, time_scale=time_scale, trace=trace, faults=fault, baud=baud, port=0 if harms else port
            )
        )
        url = stack.enter_context(bad_cable(machine.url, harms, port)) if harms else machine.url
        say(f"EMULATED machine at {url} (Ctrl-C ends it)")
        try:
            while machine.process.poll() is None:
                time.sleep(0.2)
        except KeyboardInterrupt:
            say("ended")
    return DONE
