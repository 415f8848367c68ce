"""How large the part becomes: scale, units that make no sense, sheet and kerf."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planner.errors import MeshError
from planner.fold_plan import MachineLimits
from planner.mesh_edges import edge_table, face_heights
from planner.raw_mesh import RawMesh, TriangleMesh, counted, file_error

__all__ = ["SMALLEST_MM", "kerf_notices", "require_fit", "require_precision", "scale_factor"]

SMALLEST_MM = 10.0
"""A longest side below this, without a size or scale given, suggests that the file is not in mm."""

_UNITS = (("centimetres", 10.0), ("inches", 25.4), ("metres", 1000.0))


def scale_factor(
    raw: RawMesh, longest: float, size_mm: float | None, scale: float | None
) -> tuple[float, tuple[str, ...]]:
    """Factor from the file's numbers to mm, and what to say about it.

    Args:
        raw: the file.
        longest: longest side of the used vertices, in the file's numbers.
        size_mm: longest side that the part shall have.
        scale: factor on the file's numbers.

    Raises:
        MeshError: both or senseless values given, no extent, or a size that suggests another unit.
    """
    for name, value in (("size", size_mm), ("scale", scale)):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise file_error(
                raw.source, f"{name} {value:g} makes no sense", "give a finite number greater than 0"
            )
    if size_mm is not None and scale is not None:
        raise file_error(raw.source, "both size and scale are given", "give one of them")
    if not longest > 0.0:
        raise file_error(raw.source, "all vertices lie in one point", "check the mesh in a modelling program")
    if size_mm is not None:
        factor = size_mm / longest
        if abs(factor - 1.0) < 1e-6:
            return 1.0, ()
        return factor, (f"scaled by {factor:.6g} to a longest side of {size_mm:g} mm",)
    if scale is not None:
        words = (
            () if scale == 1.0 else (f"scaled by {scale:g} to a longest side of {scale * longest:.4g} mm",)
        )
        return scale, words
    if raw.unit_mm is not None:
        size = raw.unit_mm * longest
        return raw.unit_mm, (f"the format prescribes metres: longest side {size:.4g} mm (else give a size)",)
    if longest < SMALLEST_MM:
        guesses = [f"{longest * f:.3g} mm in {u}" for u, f in _UNITS if longest * f >= SMALLEST_MM]
        would = f" (it would be {', '.join(guesses)})" if guesses else ""
        raise file_error(
            raw.source,
            f"the longest side is {longest:.3g}; in mm that is too small to fold, so the unit seems to be "
            f"another one{would}",
            "give the longest side in mm with --size, or a factor with --scale (--scale 1 if it is in mm)",
        )
    return 1.0, ()


def require_precision(raw: RawMesh, factor: float, limits: MachineLimits) -> None:
    """Refuse single-precision coordinates so far out that their steps show in the part.

    Raises:
        MeshError: the step between neighbouring numbers is more than a tenth of the kerf.
    """
    if not raw.single_precision:
        return
    # coordinates that a scene's matrices moved out were exact before, so this only errs to the safe side
    far = float(np.abs(raw.vertices[raw.corners]).max())
    step = float(np.spacing(np.float32(far))) * factor
    if step > 0.1 * limits.kerf:
        raise file_error(
            raw.source,
            f"the mesh lies {far * factor:.4g} mm from the origin, where its single-precision numbers have "
            f"steps of {step:.2g} mm: the shape is destroyed",
            "move the mesh to the origin in the program that made it and export it again",
        )


def require_fit(source: str, longest_mm: float, area_mm2: float, limits: MachineLimits) -> None:
    """Refuse a part that no sheet of the rig can hold.

    Raises:
        MeshError: longer than the diagonal of the work area, or more surface than the area in the frame.
    """
    width, height = (side - 2.0 * limits.frame_margin for side in limits.work_area)
    room, diagonal = width * height, math.hypot(width, height)
    if longest_mm <= diagonal and area_mm2 <= room:
        return
    fits = longest_mm * min(diagonal / longest_mm, math.sqrt(room / area_mm2) if area_mm2 else math.inf)
    surface = f" and {area_mm2:.4g} mm² of surface" if area_mm2 else ""
    raise MeshError(
        f"{source}: the part has a longest side of {longest_mm:.4g} mm{surface}, "
        f"the sheet inside the frame has {width:g} x {height:g} mm; give a smaller longest side with --size "
        f"(well below {fits:.3g}), or a scale (is the file in another unit than mm?)"
    )


def kerf_notices(mesh: TriangleMesh, limits: MachineLimits) -> tuple[str, ...]:
    """What to say about features below the kerf of a mesh in mm.

    Raises:
        MeshError: most edges are so short that the part is all kerf.
    """
    lengths = _edge_lengths(mesh.vertices, mesh.faces)
    if float(np.median(lengths)) < 3.0 * limits.kerf:
        raise mesh.error(
            f"half of the edges are shorter than {3.0 * limits.kerf:g} mm, three times the kerf of the laser "
            f"(longest side {float(np.ptp(mesh.vertices, axis=0).max()):.3g} mm)",
            "make the part larger (--size) or coarser (--faces)",
        )
    short = int((lengths < limits.kerf).sum())
    low = int((face_heights(mesh.vertices, mesh.faces) < limits.kerf).sum())
    if short or low:
        both = f"{counted(short, 'edge')} and {counted(low, 'face')}"
        return (f"{both} smaller than the kerf of {limits.kerf:g} mm",)
    return ()


def _edge_lengths(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """(E,) lengths of all edges."""
    ends = vertices[edge_table(faces).edges]
    lengths: NDArray[np.float64] = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return lengths
