"""Where the light comes from, seen from the sheet: parallel light, or rays from the scan centre of a head."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import MachineLimits

__all__ = ["to_light"]


def to_light(
    rotary_rad: float,
    point: NDArray[np.float64],
    limits: MachineLimits,
    axis: NDArray[np.float64] | None = None,
    origin: tuple[float, float] = (0.0, 0.0),
) -> NDArray[np.float64]:
    """(3,) unit vector from ``point`` towards the light, in the frame of the sheet.

    Args:
        rotary_rad: rotary angle: the part is turned by it about the rotary axis (right hand).
        point: (3,) in the frame of the sheet, mm.
        limits: of the machine; ``beam_source`` says where the light comes from.
        axis: (2,) unit direction of the rotary axis in the sheet; None: +x.
        origin: point on that axis under the middle of the work area, mm.
    """
    ex, ey = (1.0, 0.0) if axis is None else (float(axis[0]), float(axis[1]))
    c, s = math.cos(rotary_rad), math.sin(rotary_rad)
    if limits.beam_source is None:
        return np.array([-s * ey, s * ex, c])
    along, over, height = limits.beam_source
    across, z = over * c + height * s, height * c - over * s
    source = np.array([origin[0] + along * ex - across * ey, origin[1] + along * ey + across * ex, z])
    ray: NDArray[np.float64] = source - point
    return ray / np.linalg.norm(ray)
