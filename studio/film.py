"""Pictures of a plan as it is folded, by MuJoCo's renderer: moments, camera, frames."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError

if TYPE_CHECKING:
    from planner.fold_plan import FoldPlan
    from twin.mjcf_model import CompiledModel

__all__ = ["Moment", "RenderError", "Stage", "choose_gl", "moments"]

_FOLD_DEG_S, _ROTARY_DEG_S, _STILL_S = 90.0, 180.0, 0.25


class RenderError(StudioError, RuntimeError):
    """No picture can be made on this computer (exit code 2)."""


@dataclass(frozen=True)
class Moment:
    """One picture's worth of a plan.

    Attributes:
        step: index of the plan step that is under way; the number of steps at the end.
        joints: joint → angle, rad.
        rotary_rad: angle of the rotary.
        gone: (S,) True for the pieces of the sheet that are clipped.
        crease: net edge that is being folded, -1 if none.
        released: the part is cut free.
    """

    step: int
    joints: dict[str, float]
    rotary_rad: float
    gone: NDArray[np.bool_]
    crease: int
    released: bool = False


def moments(plan: FoldPlan, compiled: CompiledModel, per_second: float) -> Iterator[Moment]:
    """The plan in pictures: folds at 90 degrees a second, rotations at 180.

    Args:
        plan: the plan.
        compiled: its model.
        per_second: pictures of a second; 0 gives only the moment after every step.
    """
    from planner.fold_plan import Release, Rotate
    from twin.timeline import turns

    side = compiled.side
    by_step = {turn.step: turn for turn in turns(plan, side)}
    gone_at = np.array([p.gone_at for p in side.pieces], dtype=np.int64)
    joints: dict[str, float] = {}
    rotary, released = 0.0, False
    gone = np.zeros(len(gone_at), dtype=np.bool_)
    yield Moment(0, {}, rotary, gone, -1)
    for number, step in enumerate(plan.steps):
        turn = by_step.get(number)
        before = gone
        gone = (gone_at >= 0) & (gone_at <= number)
        if turn is not None:
            seconds = math.degrees(abs(turn.to_rad - turn.from_rad)) / _FOLD_DEG_S
            for share in _shares(seconds, per_second):
                joints = {**joints, turn.joint: turn.from_rad + share * (turn.to_rad - turn.from_rad)}
                yield Moment(number, joints, rotary, gone, turn.crease, released)
        elif isinstance(step, Rotate):
            start = rotary
            for share in _shares(math.degrees(abs(step.to_rad - start)) / _ROTARY_DEG_S, per_second):
                rotary = start + share * (step.to_rad - start)
                yield Moment(number, joints, rotary, gone, -1, released)
        elif isinstance(step, Release):
            released = True
            for _ in _shares(2.0, per_second):
                yield Moment(number, joints, rotary, gone, -1, released)
        elif not np.array_equal(before, gone):
            for _ in _shares(_STILL_S, per_second):
                yield Moment(number, joints, rotary, gone, -1, released)
        elif per_second <= 0.0:
            yield Moment(number, joints, rotary, gone, -1, released)


def _shares(seconds: float, per_second: float) -> NDArray[np.float64]:
    count = max(1, math.ceil(seconds * per_second))
    shares: NDArray[np.float64] = np.arange(1, count + 1) / count
    return shares


def choose_gl() -> None:
    """Have MuJoCo draw without a screen where there is none; to be called before MuJoCo is imported."""
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        os.environ.setdefault("MUJOCO_GL", "egl")


class Stage:
    """The model of a plan before a camera; a context manager.

    Args:
        plan: the plan.
        compiled: its model.
        width: of the pictures.
        height: of the pictures.
        azimuth_deg: of the camera.
        elevation_deg: of the camera.

    Raises:
        RenderError: if there is no way to draw here.
    """

    def __init__(
        self, plan: FoldPlan, compiled: CompiledModel, width: int, height: int, azimuth_deg: float = 125.0,
        elevation_deg: float = -32.0,
    ) -> None:  # fmt: skip
        import mujoco

        from twin.loaded_model import LoadedModel, quiet_mujoco

        self.plan = plan
        self.loaded = LoadedModel(compiled, plan.net)
        model = self.loaded.model
        model.vis.global_.offwidth = max(int(model.vis.global_.offwidth), width)
        model.vis.global_.offheight = max(int(model.vis.global_.offheight), height)
        try:
            with quiet_mujoco():
                self.renderer: Any = mujoco.Renderer(model, height, width)
        except Exception as error:
            raise RenderError(
                f"cannot draw here ({error}): install a GL library (Debian: libegl1, "
                "libgl1-mesa-dri), or set "
                "MUJOCO_GL to egl, osmesa or glfw"
            ) from error
        self.camera: Any = mujoco.MjvCamera()
        mujoco.mjv_defaultFreeCamera(model, self.camera)
        span = float(np.ptp(plan.sheet.outline, axis=0).max())
        low, high = np.min(plan.sheet.outline, axis=0), np.max(plan.sheet.outline, axis=0)
        self.camera.lookat[:] = (*(0.5 * (low + high)), 0.0)
        self.camera.distance = 1.45 * span
        self.camera.azimuth, self.camera.elevation = azimuth_deg, elevation_deg
        self._middle = plan.net.vertices[plan.net.edges].mean(axis=1)
        self._faces = set(self.loaded.face_geom.tolist())

    def __enter__(self) -> Stage:
        """Ready to draw."""
        return self

    def __exit__(self, *_: object) -> None:
        """Give the graphics memory back."""
        self.renderer.close()

    def picture(self, moment: Moment) -> NDArray[np.uint8]:
        """(H, W, 3) picture of a moment."""
        import mujoco

        loaded, data = self.loaded, self.loaded.data
        for joint, angle in moment.joints.items():
            loaded.set_angle(joint, angle)
        loaded.all_contacts_on(moment.gone)
        loaded.set_rotary(moment.rotary_rad)
        self._aim(moment)
        mujoco.mj_kinematics(loaded.model, data)
        mujoco.mj_comPos(loaded.model, data)
        mujoco.mj_camlight(loaded.model, data)
        if moment.released:
            self._alone()
        self.renderer.update_scene(data, self.camera)
        scene = self.renderer.scene  # turn all of it so that the machine stands and the sheet turns
        half = 0.0 if moment.released else moment.rotary_rad / 2.0
        scene.enabletransform = 1
        scene.translate[:] = 0.0
        scene.rotate[:] = (math.cos(half), math.sin(half), 0.0, 0.0)
        scene.scale = 1.0
        cos, sin = math.cos(2.0 * half), math.sin(2.0 * half)
        for light in scene.lights[: scene.nlight]:  # lights stay where they are
            for vector in (light.pos, light.dir):
                y, z = float(vector[1]), float(vector[2])
                vector[1], vector[2] = cos * y + sin * z, cos * z - sin * y
        image: NDArray[np.uint8] = self.renderer.render().copy()
        return image

    def _alone(self) -> None:
        """Show nothing but the part, from near."""
        loaded = self.loaded
        others = [g for g in range(loaded.model.ngeom) if g not in self._faces]
        loaded.model.geom_rgba[others, 3] = 0.0
        loaded.model.geom_matid[others] = -1
        places = loaded.data.geom_xpos[loaded.face_geom]
        self.camera.lookat[:] = 0.5 * (places.min(axis=0) + places.max(axis=0))
        self.camera.distance = 1.9 * max(float(np.ptp(places, axis=0).max()), 1.0)

    def _aim(self, moment: Moment) -> None:
        """Put the head over the crease that is being folded; away from the part where there is none."""
        import mujoco

        model = self.loaded.model
        body = int(model.body_mocapid[model.body("laser_head").id])
        place = np.append(self._middle[moment.crease] if moment.crease >= 0 else np.zeros(2), 0.0)
        self.loaded.data.mocap_pos[body] = place
        beam = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "laser_beam")
        if beam >= 0:
            model.geom_matid[beam] = -1
            model.geom_rgba[beam] = (1.0, 0.12, 0.08, 0.9 if moment.crease >= 0 else 0.0)
