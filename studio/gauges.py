"""Which gauge measures the creases while a job runs: by what stands behind ``--measure``."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from studio.errors import UsageError
from studio.workspace import Workspace

if TYPE_CHECKING:
    from rigs.measuring import Measure, SerialGauge
    from rigs.rotary_encoder import RotaryEncoder
    from twin.workpiece import Workpiece

__all__ = ["CAMERA", "TYPED", "VIRTUAL", "encoder_of", "gauge_of", "is_virtual", "workpiece_of"]

TYPED, VIRTUAL, CAMERA = "typed", "virtual", "virtual-camera"
"""Ways to measure beside a port and a camera file: a person types; the part in the emulated machine is
read by a gauge on a port, or seen by a camera."""

_STREAM = "stream:"
_PORT = re.compile(r"(.+?)(?:@(\d+))?")
_BAUD, _BAUDS = 115200, (300, 4_000_000)


def is_virtual(measure: str | None) -> bool:
    """True for ways that need the emulated machine."""
    return measure is not None and measure.partition(":")[0] in (VIRTUAL, CAMERA)


def workpiece_of(ws: Workspace, gain: float = 1.0) -> Workpiece:
    """The flat part of a bundle."""
    from twin.workpiece import Workpiece

    return Workpiece(ws.plan, ws.process, ws.rig, ws.material, gain)


def gauge_of(
    ws: Workspace,
    measure: str,
    trace: Path | None,
    stack: contextlib.ExitStack,
    folded_rad: Mapping[int, float],
) -> Measure:
    """The gauge that ``measure`` names.

    Args:
        ws: the bundle.
        measure: ``typed``; a camera file (``.toml``); ``virtual`` or ``virtual-camera``, both with
            ``:FACTOR`` if the part shall bend by another factor than the model; or the port of a gauge,
            ``@BAUD`` behind it if it is not 115200, ``stream:`` before it if the gauge prints by itself.
        trace: of the emulated machine.
        stack: closes what is opened.
        folded_rad: crease → angle that the part in the emulated machine has already.

    Raises:
        UsageError: if it makes no sense here.
        MachineError: if gauge or camera do not answer.
        ProfileError: if the camera file has a mistake.
    """
    from rigs.measuring import TypedGauge

    if measure == TYPED:
        if not sys.stdin.isatty():
            raise UsageError("--measure typed needs a terminal on which angles can be typed")
        return TypedGauge(_ask)
    if is_virtual(measure):
        return _virtual(ws, measure, trace, stack, folded_rad)
    if measure.endswith(".toml"):
        from rigs.camera import CameraGauge, open_pictures
        from rigs.camera_file import read_camera

        net = ws.plan.net
        file = read_camera(Path(measure), len(net.faces))
        return CameraGauge(net, file, open_pictures(file.camera.source))
    return _port("--measure", measure, stack)


def encoder_of(ws: Workspace, port: str, trace: Path | None, stack: contextlib.ExitStack) -> RotaryEncoder:
    """What reads the encoder of the rotary.

    Args:
        ws: the bundle.
        port: of the encoder, written as that of a gauge; ``virtual`` for the emulated machine's.
        trace: of the emulated machine.
        stack: closes what is opened.

    Raises:
        UsageError: if it makes no sense here.
        MachineError: if the encoder does not answer.
    """
    from rigs.rotary_encoder import RotaryEncoder

    if port == VIRTUAL:
        if trace is None:
            raise UsageError("--encoder virtual is for --port emulator: a real machine needs a real encoder")
        from twin.gauge_port import gauge_port
        from twin.traced_part import TracedPart

        port = stack.enter_context(gauge_port(TracedPart(trace, ws.rig, workpiece_of(ws))))
    gauge = _port("--encoder", port, stack)
    return RotaryEncoder(ws.rig, lambda: gauge.reading("A", "the rotary")[0])


def _port(flag: str, text: str, stack: contextlib.ExitStack) -> SerialGauge:
    """A gauge on a port, ``[stream:]URL[@BAUD]``."""
    from rigs.measuring import SerialGauge

    match = _PORT.fullmatch(text.removeprefix(_STREAM))
    baud = int(match[2] or _BAUD) if match else 0
    if match is None or not _BAUDS[0] <= baud <= _BAUDS[1]:
        raise UsageError(f"{flag} {text}: expected the port of a gauge, such as /dev/ttyUSB1@9600")
    gauge = SerialGauge(match[1], baud=baud, streams=text.startswith(_STREAM))
    stack.callback(gauge.close)
    return gauge


def _virtual(
    ws: Workspace,
    measure: str,
    trace: Path | None,
    stack: contextlib.ExitStack,
    folded_rad: Mapping[int, float],
) -> Measure:
    from rigs.measuring import SerialGauge
    from twin.gauge_port import gauge_port
    from twin.traced_part import TracedPart
    from twin.virtual_camera import VirtualCamera

    name, _, text = measure.partition(":")
    try:
        gain = float(text) if text else 1.0
    except ValueError:
        gain = -1.0
    if not 0.1 <= gain <= 5.0:
        raise UsageError(f"--measure {measure}: expected {name} or {name}:FACTOR, such as {name}:0.8")
    if trace is None:
        raise UsageError(f"--measure {name} is for --port emulator: a real part has to be measured")
    traced = TracedPart(trace, ws.rig, workpiece_of(ws, gain))
    traced.part.angles_rad.update(folded_rad)
    if name == CAMERA:
        return VirtualCamera(ws.plan.net, traced)
    gauge = SerialGauge(stack.enter_context(gauge_port(traced)))
    stack.callback(gauge.close)
    return gauge


def _ask(question: str) -> str:
    sys.stderr.write(question)
    sys.stderr.flush()
    return sys.stdin.readline()
