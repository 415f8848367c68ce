"""Units inside MuJoCo: millimetre, gram, second. The one place where they are converted.

One unit of force is 1 g mm/s² = 1e-6 N, of torque 1 g mm²/s² = 1e-9 N m, of pressure 1 g/(mm s²) = 1 Pa.
"""

from __future__ import annotations

__all__ = [
    "GRAVITY_MM_S2", "NEWTON", "NEWTON_METRE", "PASCAL", "density_g_mm3", "force_n", "torque_n_m",
]  # fmt: skip

GRAVITY_MM_S2 = 9810.0
"""Standard gravity rounded to 9.81 m/s², in mm/s²."""

NEWTON = 1e6
"""One newton in g mm/s²."""

NEWTON_METRE = 1e9
"""One newton metre in g mm²/s²."""

PASCAL = 1.0
"""One pascal in g/(mm s²)."""


def density_g_mm3(density_kg_m3: float) -> float:
    """Density in g/mm³ from kg/m³."""
    return density_kg_m3 * 1e-6


def force_n(force: float) -> float:
    """Force in N from MuJoCo's unit."""
    return force / NEWTON


def torque_n_m(torque: float) -> float:
    """Torque in N m from MuJoCo's unit."""
    return torque / NEWTON_METRE
