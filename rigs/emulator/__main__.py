"""``python -m rigs.emulator``: an emulated GRBL laser with rotary on a loopback socket."""

from __future__ import annotations

import argparse
import json
import os
import signal
import socket
import sys
from pathlib import Path
from types import FrameType

from rigs.emulator.config import config_for
from rigs.emulator.faults import read_faults, timed_faults
from rigs.emulator.machine import GrblMachine
from rigs.emulator.server import serve
from rigs.emulator.trace import Trace
from rigs.errors import RigError
from rigs.rig import load_rig


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m rigs.emulator", description=__doc__)
    parser.add_argument("--rig", default="grbl-4axis", help="name or file of the rig to emulate")
    parser.add_argument("--port", type=int, default=0, help="TCP port on 127.0.0.1; 0 takes a free one")
    parser.add_argument(
        "--time-scale",
        type=float,
        default=1.0,
        help="simulated seconds in a real second; 0: as fast as possible",
    )
    parser.add_argument(
        "--baud", type=int, default=0, help="pace the link as a serial line, such as 115200; 0: at once"
    )
    parser.add_argument("--trace", type=Path, help="write what the machine did to this file, JSON lines")
    parser.add_argument("--fault", action="append", default=[], help="KIND[:CODE]@LINE or @SECONDSs")
    parser.add_argument("--set", action="append", default=[], help="change a setting, such as 32=0")
    parser.add_argument("--with-parent", action="store_true", help="end when standard input closes")
    return parser


def main(arguments: list[str] | None = None) -> int:
    """Run the emulator; prints one JSON line with its URL once it listens."""
    options = _arguments().parse_args(arguments)
    try:
        rig = load_rig(options.rig)
        config = config_for(rig).with_settings(
            {int(key): float(value) for key, _, value in (text.partition("=") for text in options.set)}
        )
        faults, timed = read_faults(options.fault), timed_faults(options.fault)
        trace = Trace(options.trace.open("w", encoding="ascii", buffering=1) if options.trace else None)
        listener = socket.create_server(("127.0.0.1", options.port))
    except (RigError, OSError, ValueError) as error:
        sys.stderr.write(f"emulator: {error}\n")
        return 2
    machine = GrblMachine(config, trace, faults, timed)
    url = f"socket://127.0.0.1:{listener.getsockname()[1]}"
    sys.stdout.write(json.dumps({"url": url, "emulated": True, "rig": rig.name, "pid": os.getpid()}) + "\n")
    sys.stdout.flush()

    def stop(_signum: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    if options.with_parent:
        for number in ("SIGINT", "SIGTSTP"):  # Ctrl-C and Ctrl-Z are for the parent, which ends this process
            if hasattr(signal, number):
                signal.signal(getattr(signal, number), signal.SIG_IGN)
    try:
        parent = sys.stdin.fileno() if options.with_parent else None
        serve(machine, listener, options.time_scale, parent, options.baud)
    except KeyboardInterrupt:
        pass
    finally:
        machine.advance(machine.now)
        trace.rest(machine.now, 0.0)
        trace.write({"kind": "end", "t": round(machine.now, 6), "lines": machine.lines_seen,
                     "beam_s": round(trace.beam_s, 6), "rest_beam_s": round(trace.rest_beam_s, 6),
                     "position": [round(v, 5) for v in machine.motion.state(machine.now)[0]]})  # fmt: skip
        trace.close()
        listener.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
