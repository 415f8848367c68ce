"""Temperatures under a moving Gaussian spot on a plate of finite thickness (Green's function)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["cross_section_rise", "peak_rise_per_watt", "temperature_rise"]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
_TOP_PLACES = np.linspace(-0.1, 1.3, 12)
"""Where the peak of the lit face is looked for behind the spot, in units of its radius."""

_BOTTOM_PLACES = np.linspace(0.0, 1.0, 16) ** 1.5 * 1.5
"""Where the peak of the other face is looked for, in units of w + v h² / (2 a)."""


def temperature_rise(
    behind: ArrayLike,
    depth: ArrayLike,
    *,
    speed: ArrayLike,
    thickness: ArrayLike,
    along: ArrayLike,
    across: ArrayLike,
    diffusivity: ArrayLike,
    heat_capacity: ArrayLike,
) -> NDArray[np.float64]:
    """Steady temperature rise per absorbed watt on the line of the beam, K/W. SI units, arrays broadcast.

    ``1 / (rho c) * integral dtau Gx Gy Gz`` with Gaussians of variance ``w² / 4 + 2 a tau`` in the plane and
    mirror images (short times) or cosine modes (long times) through the thickness; both faces insulated,
    properties constant. Source: Carslaw and Jaeger, Conduction of Heat in Solids, 1959, ch. 10 and 14.

    Args:
        behind: distance behind the centre of the spot, m.
        depth: distance from the lit face, m.
        speed: of the spot, m/s, > 0.
        thickness: of the plate, m.
        along: 1/e² radius of the spot along the scan, m.
        across: the same across the scan, m.
        diffusivity: a = k / (rho c), m²/s.
        heat_capacity: rho c, J/(m³ K).
    """
    x, z, v, h, wx, wy, a, rc = (
        np.asarray(value, dtype=np.float64)[..., None]
        for value in (behind, depth, speed, thickness, along, across, diffusivity, heat_capacity)
    )
    tau, weight = _moments(x, v, wx, a)
    sx, sy = wx**2 / 4.0 + 2.0 * a * tau, wy**2 / 4.0 + 2.0 * a * tau
    plane = np.exp(-((v * tau - x) ** 2) / (2.0 * sx)) / (2.0 * np.pi * np.sqrt(sx * sy))
    rise: NDArray[np.float64] = np.sum(weight * plane * _through(z, h, a * tau), axis=-1) / rc[..., 0]
    return rise


def cross_section_rise(
    times: NDArray[np.float64],
    places: NDArray[np.float64],
    depths: NDArray[np.float64],
    *,
    speed: float,
    thickness: float,
    along: float,
    across: float,
    diffusivity: float,
    heat_capacity: float,
) -> NDArray[np.float64]:
    """Temperature rise per absorbed watt in a section across the scan, K/W. SI units.

    The same integral as in ``temperature_rise``; the spot passes the section at time 0.

    Args:
        times: (T,) s.
        places: (S,) distances from the line of the beam, m.
        depths: (Z,) distances from the lit face, m.
        speed: of the spot, m/s, > 0.
        thickness: of the plate, m.
        along: 1/e² radius of the spot along the scan, m.
        across: the same across the scan, m.
        diffusivity: a = k / (rho c), m²/s.
        heat_capacity: rho c, J/(m³ K).

    Returns:
        (T, S, Z).
    """
    behind = (speed * times)[:, None]
    v, wx, a, h = (np.asarray(value, dtype=np.float64) for value in (speed, along, diffusivity, thickness))
    tau, weight = _moments(behind, v, wx, a)
    sx, sy = along**2 / 4.0 + 2.0 * diffusivity * tau, across**2 / 4.0 + 2.0 * diffusivity * tau
    line = weight * np.exp(-((speed * tau - behind) ** 2) / (2.0 * sx)) / (2.0 * np.pi * np.sqrt(sx * sy))
    sideways = np.exp(-(places[None, :, None] ** 2) / (2.0 * sy[:, None, :]))
    through = _through(depths[None, :, None], h, diffusivity * tau[:, None, :])
    rise: NDArray[np.float64] = (line[:, None, :] * sideways) @ through.transpose(0, 2, 1) / heat_capacity
    return rise


def peak_rise_per_watt(
    *,
    speed: ArrayLike,
    thickness: ArrayLike,
    along: ArrayLike,
    across: ArrayLike,
    diffusivity: ArrayLike,
    heat_capacity: ArrayLike,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Largest temperature rise per absorbed watt of the lit and of the other face, K/W. SI units."""
    v, h, wx, wy, a, rc = np.broadcast_arrays(
        *(
            np.asarray(value, dtype=np.float64)[..., None]
            for value in (speed, thickness, along, across, diffusivity, heat_capacity)
        )
    )
    fixed = {
        "speed": v, "thickness": h, "along": wx, "across": wy, "diffusivity": a, "heat_capacity": rc,
    }  # fmt: skip
    top = temperature_rise(_TOP_PLACES * wx, np.zeros_like(h), **fixed).max(axis=-1)
    bottom = temperature_rise(_BOTTOM_PLACES * (wx + 0.5 * v * h**2 / a), h, **fixed).max(axis=-1)
    return top, bottom


def _moments(
    x: NDArray[np.float64], v: NDArray[np.float64], wx: NDArray[np.float64], a: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Ages of the heat felt ``x`` behind the spot, and their quadrature weights, along a last axis."""
    # The spot counts while it is within five standard deviations (in place, then) of the point.
    reach = x * v + 25.0 * a
    root = np.sqrt(np.maximum(reach**2 - v**2 * (x**2 - 6.25 * wx**2), 0.0))
    first, last = np.maximum(reach - root, 0.0) / v**2, np.maximum(reach + root, 0.0) / v**2
    power = np.where(first > 0.02 * last, 1.0, 4.0)  # times near 0 need care where they count
    u = 0.5 * (_NODES + 1.0)
    tau = first + (last - first) * u**power
    weight = 0.5 * _WEIGHTS * power * u ** (power - 1.0) * (last - first)
    return tau, weight


def _through(z: NDArray[np.float64], h: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Spread of heat through the thickness, 1/m, from the face z = 0 after ``at`` = a tau."""
    images = sum(np.exp(-((z - 2.0 * n * h) ** 2) / (4.0 * np.maximum(at, 1e-300))) for n in (-1, 0, 1))
    early = images / np.sqrt(np.pi * np.maximum(at, 1e-300))
    late = np.ones(np.broadcast_shapes(z.shape, at.shape))
    for n in range(1, 6):
        late = late + 2.0 * np.cos(n * np.pi * z / h) * np.exp(-((n * np.pi / h) ** 2) * at)
    spread: NDArray[np.float64] = np.where(at < 0.1 * h**2, early, late / h)
    return spread
