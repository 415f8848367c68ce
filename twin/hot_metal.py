"""Thermal properties of a metal where the laser heats it, and the peak temperatures of a pass."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rigs.material import Material
from twin.moving_spot import peak_rise_per_watt

__all__ = ["HotMetal", "SpotRises", "mean_properties", "melting_heat", "peak_temperatures", "spot_rises"]

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
    capacity, _ = mean_properties(material, np.array([20.0]), np.array([solidus]))
    latent = 1e3 * material.constants.latent_heat_kj_kg
    return float(capacity[0]) * (solidus - 20.0) + material.density_kg_m3 * latent


class SpotRises:
    """Temperature rise under a moving spot for many speeds and any diffusivity between two limits.

    The rise is computed on a few diffusivities and interpolated in between: its logarithm is almost a
    straight line over that of the diffusivity. SI units.

    Args:
        diffusivities: smallest and largest.
        speed: of the spot, any shape.
        thickness: of the sheet.
        along: 1/e² radius of the spot along the scan.
        across: the same across the scan.
    """

    def __init__(
        self, diffusivities: tuple[float, float], speed: NDArray[np.float64], thickness: float, along: float,
        across: float,
    ) -> None:  # fmt: skip
        speeds, inverse = np.unique(speed, return_inverse=True)
        self._speed = inverse.reshape(speed.shape)
        self._place, self._kernels = _spot_kernels(
            diffusivities, tuple(speeds.tolist()), thickness, along, across
        )

    def per_watt(
        self, capacity: NDArray[np.float64], conductivity: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rise of the lit and of the other face in K per absorbed watt, one entry per speed."""
        place = self._place
        x = np.clip(np.log(conductivity / capacity), place[0], place[-1])
        left = np.clip(np.searchsorted(place, x, side="right") - 1, 0, len(place) - 2)
        share = (x - place[left]) / (place[left + 1] - place[left])
        top, bottom = (
            np.exp(k[self._speed, left] * (1.0 - share) + k[self._speed, left + 1] * share) / capacity
            for k in self._kernels
        )
        return top, bottom


@lru_cache(maxsize=128)
def _spot_kernels(
    diffusivities: tuple[float, float],
    speeds: tuple[float, ...],
    thickness: float,
    along: float,
    across: float,
) -> tuple[NDArray[np.float64], tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Logarithms of the diffusivities and of the rises times rho c, which they alone decide."""
    grid = np.geomspace(*diffusivities, 5)
    top, bottom = peak_rise_per_watt(
        speed=np.array(speeds)[:, None], thickness=thickness, along=along, across=across,
        diffusivity=grid[None, :], heat_capacity=1.0,
    )  # fmt: skip
    return np.log(grid), (np.log(np.maximum(top, 1e-300)), np.log(np.maximum(bottom, 1e-300)))


def spot_rises(
    material: Material, speed: NDArray[np.float64], thickness: float, along: float, across: float
) -> SpotRises:
    """Rises for all diffusivities that ``material`` has up to its solidus. SI units."""
    span = np.linspace(20.0, material.constants.solidus_c, 16)
    all_of_them = [HotMetal.at(material, t).diffusivity for t in span.tolist()]
    limits = (0.9 * min(all_of_them), 1.1 * max(all_of_them))
    return SpotRises(limits, speed, thickness, along, across)


def peak_temperatures(
    material: Material, rises: SpotRises, absorbed: NDArray[np.float64], start_c: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Peak temperatures of both faces, °C, properties at their mean between start and peak.

    Three rounds of fixed-point iteration on the mean properties.

    Args:
        material: what the sheet is made of.
        rises: of the spot.
        absorbed: absorbed power, W, one entry per speed of ``rises``.
        start_c: temperature before.
    """
    solidus = material.constants.solidus_c
    peak = np.full(absorbed.shape, 0.5 * solidus)
    start = np.full(absorbed.shape, start_c)
    for _ in range(3):
        top, bottom = rises.per_watt(*mean_properties(material, start, peak))
        peak = np.minimum(start_c + absorbed * top, solidus)
    return start_c + absorbed * top, start_c + absorbed * bottom


def mean_properties(
    material: Material, low_c: NDArray[np.float64], high_c: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean heat capacity per volume and conductivity between two temperatures, °C, by 64 midpoints."""
    x = np.asarray(material.table.temperature_c)
    share = (np.arange(64) + 0.5) / 64.0
    t = low_c[..., None] + np.maximum(high_c - low_c, 1.0)[..., None] * share
    capacity = np.interp(t, x, material.table.heat_capacity_j_kgk).mean(axis=-1)
    conductivity = np.interp(t, x, material.table.conductivity_w_mk).mean(axis=-1)
    return material.density_kg_m3 * capacity, conductivity
