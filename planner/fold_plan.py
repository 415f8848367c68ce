"""The sheet and the fold plan: ordered fabrication steps, metrics and what stays blocked."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.diagnosis import Diagnosis
from planner.net import Net
from planner.values import frozen_array

__all__ = [
    "Bend", "Blocked", "Clip", "Cut", "Fold", "FoldPlan", "MachineLimits", "PlanMetrics", "Point",
    "Polyline", "Release", "Rotate", "Sheet", "Step", "Tab", "Wait",
]  # fmt: skip

Point = tuple[float, float]
Polyline = tuple[Point, ...]
"""Points in the sheet plane, mm; closed when the first point is repeated at the end."""


@dataclass(frozen=True)
class MachineLimits:
    """What a rig and a material allow, as far as planning needs to know it. Lengths in mm.

    Attributes:
        thickness: of the sheet.
        kerf: width of a cut.
        work_area: (x, y) extent that the beam reaches, centred on the middle of the rotary axis.
        axis_height: height of the rotary axis over the bed (the lowest fixed part).
        lens_height: height of the lowest part of the head over the rotary axis, head fully raised.
        max_tilt_rad: largest rotary angle away from 0 or 180 degrees.
        beam_radius: largest beam radius at the part of the crease.
        beam_spread: how much wider the beam's radius gets per mm above the crease.
        beam_source: where the light comes from if not parallel to the head's axis: along the rotary axis,
            across and over it, from the middle of the work area, mm; None: parallel light.
        frame_margin: width of the strip all around the sheet that the frame clamps.
        clamp_height: how far the frame's bars over that strip stand out of the sheet plane, on either side.
        clamps: polygons of what clamps the sheet farther in, as high as the bars, in the frame of the sheet,
            x along the rotary axis, the origin in the middle of the work area.
        clearance: how far every face is set in from its edges when contact is tested (>= kerf / 2).
        depth_of_focus: total focus depth; with ``focus_travel`` the head follows a tilted crease.
        focus_travel: travel of the focus axis over and under the sheet plane (0: none).
        weight_n_mm2: weight of the sheet, N per mm².
        plastic_moment_n: moment at which a crease yields all through, N mm per mm of its length.
        bend_width: width of the strip beside a crease that bends, in the flat sheet (0: sharp creases).
        neutral_shift: how far beyond the middle of the sheet, away from the beam, the fibre lies that keeps
            its length when a crease bends.
        relief_mm: largest radius of the holes where creases meet (0: none).
    """

    thickness: float = 0.1
    kerf: float = 0.1
    work_area: tuple[float, float] = (400.0, 300.0)
    axis_height: float = 150.0
    lens_height: float = 150.0
    max_tilt_rad: float = float(np.radians(30.0))
    beam_radius: float = 0.05
    beam_spread: float = 0.0
    beam_source: tuple[float, float, float] | None = None
    frame_margin: float = 10.0
    clearance: float = 0.05
    depth_of_focus: float = 3.0
    focus_travel: float = 120.0
    weight_n_mm2: float = 7.75e-6
    plastic_moment_n: float = 0.66
    bend_width: float = 0.0
    neutral_shift: float = 0.0
    relief_mm: float = 0.0
    clamp_height: float = 0.0
    clamps: tuple[Polyline, ...] = ()


@dataclass(frozen=True)
class Tab:
    """An uncut stretch of a base panel's boundary that ties it to the frame until ``release``.

    Where ``edge`` is a crease the tab is a neck at the corner of the base panel in which that crease ends:
    the stretch is its section, across it through the corner, see ``planner.corner_tabs``.

    Attributes:
        edge: the net edge of the base panel that it lies on (assignment B), or a crease of it.
        start: one end of the stretch, on the edge, mm; the way out of the panel is to the right from here.
        end: the other end.
    """

    edge: int
    start: Point
    end: Point


@dataclass(frozen=True, eq=False)
class Sheet:
    """The metal around the net, in the frame of the net (z = 0, mm).

    Attributes:
        outline: (K, 2) corners of the sheet, counter-clockwise, not repeated.
        vertices: (S, 2) vertices of the substrate triangulation.
        faces: (T, 3) substrate triangles, counter-clockwise: all of the sheet but the net and its kerf.
        frame_faces: (T,) True where the triangle belongs to the clamped frame (never clipped).
        tabs: what holds the base panel.
        rotary_axis: (2, 2) two points on the rotary axis; the axis runs along +x through y = 0.
        clamp_height: how far the frame's bars stand out of the sheet plane, on either side, mm.
    """

    outline: NDArray[np.float64]
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    frame_faces: NDArray[np.bool_]
    tabs: tuple[Tab, ...]
    rotary_axis: NDArray[np.float64]
    clamp_height: float = 0.0

    def __post_init__(self) -> None:
        """Freeze the arrays and check their shapes."""
        for name, dtype, shape in (
            ("outline", np.float64, (None, 2)),
            ("vertices", np.float64, (None, 2)),
            ("faces", np.int64, (None, 3)),
            ("frame_faces", np.bool_, (len(self.faces),)),
            ("rotary_axis", np.float64, (2, 2)),
        ):
            object.__setattr__(self, name, frozen_array(getattr(self, name), dtype, shape))

    @cached_property
    def triangles(self) -> NDArray[np.float64]:
        """(T, 3, 2) corners of the substrate triangles."""
        return frozen_array(self.vertices[self.faces], np.float64, (None, 3, 2))


@dataclass(frozen=True)
class Cut:
    """Cut through along polylines; ``why`` says what it frees."""

    paths: tuple[Polyline, ...]
    why: str = ""


@dataclass(frozen=True)
class Clip:
    """Substrate triangles that are cut off and fall."""

    faces: tuple[int, ...]


@dataclass(frozen=True)
class Bend:
    """Substrate triangles bent away about a hinge instead of being clipped."""

    faces: tuple[int, ...]
    hinge: tuple[Point, Point]
    to_rad: float


@dataclass(frozen=True)
class Rotate:
    """Set the rotary's absolute angle: 0 = top side up, pi = bottom up, between = tilted."""

    to_rad: float


@dataclass(frozen=True)
class Fold:
    """Fold a crease (net edge index) to the absolute signed angle ``to_rad``."""

    crease: int
    to_rad: float


@dataclass(frozen=True)
class Wait:
    """Let the part cool."""

    seconds: float


@dataclass(frozen=True)
class Release:
    """Cut the tabs: the part is done."""

    paths: tuple[Polyline, ...]


Step = Cut | Clip | Bend | Rotate | Fold | Wait | Release


@dataclass(frozen=True)
class Blocked:
    """A crease that the plan does not fold all the way.

    Attributes:
        crease: net edge index.
        reached_rad: angle at the end of the plan.
        wanted_rad: goal angle.
        by: what stops it; ``room``: it is held back on purpose, so that others go further.
        blockers: faces of the net (or, for ``substrate``, triangles) that hide or touch.
        at_rad: the angle at which it is stopped.
        diagnosis: the cause measured, its witness and what would free it; None if nobody has looked.
    """

    crease: int
    reached_rad: float
    wanted_rad: float
    by: Literal["collision", "sight", "substrate", "order", "limit", "room"]
    blockers: tuple[int, ...] = ()
    at_rad: float = 0.0
    diagnosis: Diagnosis | None = None


@dataclass(frozen=True)
class PlanMetrics:
    """Figures of a plan; ``energy_j`` and ``seconds`` come from the process, 0 before it is known.

    ``swept_area`` is the area in mm² of the sheet, without frame and net, that the folds pass through: unlike
    ``clipped_area`` it depends on no triangulation, margin or tether.
    """

    fold_completion: float
    shape_rms: float
    shape_rms_rel: float
    rotations: int
    clipped_faces: int = 0
    clipped_area: float = 0.0
    swept_area: float = 0.0
    energy_j: float = 0.0
    seconds: float = 0.0


@dataclass(frozen=True, eq=False)
class FoldPlan:
    """Ordered steps that fold ``net`` out of ``sheet``.

    Attributes:
        net: the net, in the frame of the sheet (the planner places it).
        sheet: the metal around it.
        limits: what the plan was made for.
        steps: the fabrication steps, in order.
        metrics: figures of the plan.
        blocked: creases that are not folded all the way, with the reason.
        hidden_max: largest hidden share of a crease.
        without: names of the rules that were switched off for a study (usually none).
        seed: seed of every random choice.
        notices: what the user should know about the plan, in words.
    """

    net: Net
    sheet: Sheet
    limits: MachineLimits
    steps: tuple[Step, ...]
    metrics: PlanMetrics
    blocked: tuple[Blocked, ...] = ()
    hidden_max: float = 0.05
    without: tuple[str, ...] = ()
    seed: int = 0
    notices: tuple[str, ...] = field(default=())

    @cached_property
    def final_angles(self) -> NDArray[np.float64]:
        """(E,) fold angles in rad after the last step."""
        angles = np.zeros(len(self.net.edges))
        for step in self.steps:
            if isinstance(step, Fold):
                angles[step.crease] = step.to_rad
        return frozen_array(angles, np.float64, (None,))

    def with_metrics(self, **changes: float) -> FoldPlan:
        """A copy with some metrics replaced."""
        return replace(self, metrics=replace(self.metrics, **changes))  # type: ignore[arg-type]
