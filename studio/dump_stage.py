"""What a black box says, in values, words, a table and a picture."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.atomic_file import write_atomic
from studio.film import RenderError, choose_gl
from studio.png import png
from studio.report_validation import event_text

if TYPE_CHECKING:
    from twin.black_box import BlackBox
    from twin.retrace import Retrace

__all__ = ["dump_values", "dump_words", "write_dump_picture", "write_dump_states"]

_WIDTH, _HEIGHT = 960, 720


def dump_values(box: BlackBox, traced: Retrace) -> dict[str, Any]:
    """Plain values of a black box; figures that are no numbers are None."""
    from twin.event_values import event_values

    fastest, rate = traced.fastest()
    farthest, lag = traced.farthest()
    return {
        "format": "metal-blossom/black-box-summary", "version": 1, "event": event_values(box.event),
        "states": len(traced.time_s), "from_s": _number(traced.time_s[0]), "to_s": _number(traced.time_s[-1]),
        "hinges": len(traced.joints), "fastest": {"joint": fastest, "deg_s": _number(math.degrees(rate))},
        "farthest": {"joint": farthest, "deg": _number(math.degrees(lag))},
        "same_bits": traced.same_bits, "warnings": list(traced.warnings), "mujoco": box.mujoco,
        "drive": box.drive, "model_sha256": box.model_sha256, "hashes": dict(box.hashes),
    }  # fmt: skip


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def dump_words(values: dict[str, Any]) -> list[str]:
    """The same for people, a line each."""
    fast, far = values["fastest"], values["farthest"]
    same = {
        True: "yes, bit for bit",
        False: "no: the steps give other bits on this machine",
        None: f"cannot be said: the run was made with MuJoCo {values['mujoco']}",
    }
    return [
        event_text(values["event"]),
        f"{'states':<13}{values['states']}, {values['from_s']:.3f} s to {values['to_s']:.3f} s",
        f"{'fastest':<13}{fast['joint']}, {_told(fast['deg_s'], '°/s')}",
        f"{'off rest':<13}{far['joint']}, {_told(far['deg'], '°')}",
        f"{'again':<13}{same[values['same_bits']]}",
        *(f"{'MuJoCo says':<13}{text}" for text in values["warnings"]),
        f"{'made with':<13}MuJoCo {values['mujoco']}, model {values['model_sha256'][:12]}",
    ]


def _told(value: float | None, unit: str) -> str:
    return "no number" if value is None else f"{value:.4g}{unit}"


def write_dump_states(traced: Retrace, path: Path) -> None:
    """A row for every state and hinge: time, angle, rest angle, rate.

    Raises:
        OSError: if the file cannot be written.
    """
    lines = ["time_s,joint,angle_deg,rest_deg,rate_deg_s"]
    for k, time in enumerate(traced.time_s.tolist()):
        rows = np.degrees([traced.angle_rad[k], traced.rest_rad[k], traced.rate_rad_s[k]]).T.tolist()
        lines += [
            f"{time:.6g},{name},{angle:.9g},{rest:.9g},{rate:.9g}"
            for name, (angle, rest, rate) in zip(traced.joints, rows, strict=True)
        ]
    write_atomic(path, "\n".join(lines) + "\n")


def write_dump_picture(box: BlackBox, number: int, path: Path) -> None:
    """A picture of one state, seen from where the part fills it.

    Raises:
        RenderError: if there is no way to draw here.
        RecordFileError: if the model of the box cannot be loaded.
        OSError: if the file cannot be written.
    """
    choose_gl()
    import mujoco

    from twin.loaded_model import quiet_mujoco
    from twin.retrace import load_box, put_state

    model, data = load_box(box)
    put_state(box, model, data, number)
    with quiet_mujoco():
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)
        faces = [g for g in range(model.ngeom) if model.geom(g).name.startswith("face_")]
        places = data.geom_xpos[faces]
        if not np.isfinite(places).all():
            raise RenderError(f"state {number} has no place for some face: choose an earlier one with --at")
        camera = mujoco.MjvCamera()
        mujoco.mjv_defaultFreeCamera(model, camera)
        camera.lookat[:] = 0.5 * (places.min(axis=0) + places.max(axis=0))
        camera.distance = 2.2 * max(float(np.ptp(places, axis=0).max()), 10.0)
        camera.azimuth, camera.elevation = 125.0, -32.0
        try:
            renderer: Any = mujoco.Renderer(model, _HEIGHT, _WIDTH)
        except Exception as error:
            raise RenderError(f"cannot draw here ({error}): set MUJOCO_GL to egl, osmesa or glfw") from error
        try:
            renderer.update_scene(data, camera)
            image = renderer.render().copy()
        finally:
            renderer.close()
    write_atomic(path, png(image))
