"""Thermal properties of a metal where the laser heats it, and the peak temperatures of a pass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigs.material import Material
from twin.moving_spot import peak_rise_per_watt

__all__ = ["HotMetal", "melting_heat", "peak_temperatures"]

REFERENCE_SHARE = 0.3
"""Properties are taken at this share of the way from 20 °C to the solidus, as in the fit of the factors."""


@dataclass(frozen=True)
class HotMetal:
    """Thermal properties in SI units at one temperature range."""

    conductivity: float
    heat_capacity: float
    expansion: float
    young: float

    @property
    def diffusivity(self) -> float:
        """Thermal diffusivity, m²/s."""
        return self.conductivity / self.heat_capacity

    @classmethod
    def at(cls, material: Material, temperature_c: float) -> HotMetal:
        """Properties of ``material`` at a temperature; heat capacity is per volume."""
        return cls(
            conductivity=material.value("conductivity_w_mk", temperature_c),
            heat_capacity=material.density_kg_m3 * material.value("heat_capacity_j_kgk", temperature_c),
            expansion=1e-6 * material.value("expansion_1e6_k", temperature_c),
            young=1e9 * material.value("young_gpa", temperature_c),
        )

    @classmethod
    def reference(cls, material: Material) -> HotMetal:
        """Properties at the temperature for which the factors of the closed form hold."""
        return cls.at(material, 20.0 + REFERENCE_SHARE * (material.constants.solidus_c - 20.0))


def melting_heat(material: Material) -> float:
    """Heat that brings metal from 20 °C to liquid, J/m³."""
    solidus = material.constants.solidus_c
    capacity, _ = _means(material, np.array([20.0]), np.array([solidus]))
    latent = 1e3 * material.constants.latent_heat_kj_kg
    return float(capacity[0]) * (solidus - 20.0) + material.density_kg_m3 * latent


def peak_temperatures(
    material: Material, absorbed: NDArray[np.float64], v: NDArray[np.float64], h: float, wx: float, wy: float,
    start_c: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    """Peak temperatures of both faces, °C, properties at their mean between start and peak.

    The rise per watt is computed on a few diffusivities and interpolated in between (its logarithm is almost
    a straight line over that of the diffusivity), then three rounds of fixed-point iteration.
    """
    solidus = material.constants.solidus_c
    speeds, inverse = np.unique(v, return_inverse=True)
    inverse = inverse.reshape(v.shape)
    ends = np.array([HotMetal.at(material, t).diffusivity for t in np.linspace(20.0, solidus, 8)])
    grid = np.geomspace(0.9 * ends.min(), 1.1 * ends.max(), 4)
    both = peak_rise_per_watt(  # times rho c, which leaves the diffusivity alone to decide
        speed=speeds[:, None], thickness=h, along=wx, across=wy, diffusivity=grid[None, :], heat_capacity=1.0
    )
    kernels = [np.log(np.maximum(kernel, 1e-300)) for kernel in both]
    place = np.log(grid)
    peak = np.full(v.shape, 0.5 * solidus)
    rises = [peak, peak]
    for _ in range(3):
        capacity, conductivity = _means(material, np.full(v.shape, start_c), peak)
        x = np.clip(np.log(conductivity / capacity), place[0], place[-1])
        left = np.clip(np.searchsorted(place, x, side="right") - 1, 0, len(place) - 2)
        share = (x - place[left]) / (place[left + 1] - place[left])
        rises = [
            absorbed / capacity * np.exp(k[inverse, left] * (1.0 - share) + k[inverse, left + 1] * share)
            for k in kernels
        ]
        peak = np.minimum(start_c + rises[0], solidus)
    return start_c + rises[0], start_c + rises[1]


def _means(
    material: Material, low_c: NDArray[np.float64], high_c: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean volumetric heat capacity and conductivity between two temperatures, by 64 midpoints."""
    x = np.asarray(material.table.temperature_c)
    share = (np.arange(64) + 0.5) / 64.0
    t = low_c[..., None] + np.maximum(high_c - low_c, 1.0)[..., None] * share
    capacity = np.interp(t, x, material.table.heat_capacity_j_kgk).mean(axis=-1)
    conductivity = np.interp(t, x, material.table.conductivity_w_mk).mean(axis=-1)
    return material.density_kg_m3 * capacity, conductivity
