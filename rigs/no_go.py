"""Where light must not fall: the clamps that stand over the sheet."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

from rigs.job import MachinePoint
from rigs.rig import Rig

__all__ = ["NoGo"]


class NoGo:
    """The clamps of a rig (``sheet.clamp_polygons_mm``), asked in machine coordinates.

    Args:
        rig: the machine.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    @cached_property
    def _clamps(self) -> list[Any]:
        if not self._rig.sheet.clamp_polygons_mm:
            return []
        from shapely import Polygon

        half = self._rig.head.spot_mm / 2.0
        return [Polygon(clamp).buffer(half) for clamp in self._rig.sheet.clamp_polygons_mm]

    def hit(self, a: MachinePoint, b: MachinePoint, rotary_rad: float) -> int | None:
        """Number of the clamp that light on the way from ``a`` to ``b`` touches, or None.

        Args:
            a: position of the head, rig coordinates, mm.
            b: the same at the end of the move.
            rotary_rad: how the sheet is turned; a clamp goes with the sheet.
        """
        if not self._clamps:
            return None
        from shapely import LineString

        x0, y0, _ = self._rig.rotary.axis_point_mm
        cos = math.cos(rotary_rad)
        if abs(cos) < 1e-6:
            return 0
        ends = [(x - x0, (y - y0) / cos) for x, y, _ in (a, b)]
        line = LineString(ends)
        return next((n for n, clamp in enumerate(self._clamps) if clamp.intersects(line)), None)
