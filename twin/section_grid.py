"""Where and when the layered section is computed: layers, stations across the crease, and times of a pass."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Resolution", "SectionGrid", "section_grid"]

_AHEAD_RADII, _AHEAD_LENGTHS = 3.0, 4.0
"""A pass begins this many beam radii plus diffusion lengths a/v before the beam arrives."""

_AFTER_RADII, _AFTER_TIMES = 60.0, 40.0
"""It ends this many beam radii, or diffusion times h²/a through the sheet, after."""


@dataclass(frozen=True)
class Resolution:
    """How finely a section is divided.

    Attributes:
        stations: across one half of the section.
        layers: through the thickness.
        times: steps of a pass.
    """

    stations: int = 14
    layers: int = 10
    times: int = 150

    def finer(self, factor: float) -> Resolution:
        """The same with ``factor`` times as many of each."""
        return Resolution(*(round(factor * n) for n in (self.stations, self.layers, self.times)))


@dataclass(frozen=True, eq=False)
class SectionGrid:
    """Layers, stations and times, in SI units.

    Attributes:
        times: (T,) seconds, 0 when the beam passes.
        places: (S,) distances from the line of the beam.
        widths: (S,) quadrature weights over the whole section (both halves).
        zeta: (Z,) places of the layers above the middle, laser side positive.
        depth: (Z,) quadrature weights over the thickness.
    """

    times: NDArray[np.float64]
    places: NDArray[np.float64]
    widths: NDArray[np.float64]
    zeta: NDArray[np.float64]
    depth: NDArray[np.float64]


def section_grid(
    thickness: float, across: float, along: float, speed: float, diffusivity: float, resolution: Resolution
) -> SectionGrid:
    """The grid of one setting: fine under the beam and while it passes, coarse far away and later.

    Args:
        thickness: of the sheet, m.
        across: 1/e² radius of the beam across the crease, m.
        along: the same along it, m.
        speed: of the beam, m/s.
        diffusivity: of the hot metal, m²/s.
        resolution: how finely.
    """
    through = thickness**2 / diffusivity
    passing = along / speed
    first = -(_AHEAD_RADII * along + _AHEAD_LENGTHS * diffusivity / speed) / speed
    last = max(_AFTER_RADII * passing, _AFTER_TIMES * through)
    scale = 0.5 * passing
    steps = np.linspace(math.asinh(first / scale), math.asinh(last / scale), resolution.times)
    hot = 2.0 * passing + through
    reach = 3.0 * math.sqrt(across**2 / 4.0 + 2.0 * diffusivity * hot)
    edges = reach * np.linspace(0.0, 1.0, resolution.stations + 1) ** 1.5
    nodes, weights = np.polynomial.legendre.leggauss(resolution.layers)
    return SectionGrid(
        times=scale * np.sinh(steps),
        places=0.5 * (edges[1:] + edges[:-1]),
        widths=2.0 * np.diff(edges),
        zeta=0.5 * thickness * nodes,
        depth=0.5 * thickness * weights,
    )
