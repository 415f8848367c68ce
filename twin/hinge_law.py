"""The elastic-plastic hinge that stands for a heated crease between two rigid faces."""

from __future__ import annotations

import math
from dataclasses import dataclass

from twin.errors import ModelError
from twin.units import PASCAL

__all__ = ["STEEL_304", "HingeLaw", "SheetMetal", "hinge_law"]


@dataclass(frozen=True)
class SheetMetal:
    """What the mechanics of a thin sheet need to know of its metal, at room temperature.

    Attributes:
        young_pa: Young's modulus, Pa.
        poisson: Poisson's ratio.
        yield_pa: yield stress, Pa.
        density_kg_m3: density, kg/m³.
    """

    young_pa: float
    poisson: float
    yield_pa: float
    density_kg_m3: float

    def __post_init__(self) -> None:
        """Refuse values that no metal has."""
        for name in ("young_pa", "yield_pa", "density_kg_m3"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ModelError(f"{name} of the sheet is {value}: expected a positive figure")
        if not 0.0 <= self.poisson < 0.5:
            raise ModelError(f"Poisson's ratio of the sheet is {self.poisson}: expected 0 <= ratio < 0.5")


STEEL_304 = SheetMetal(young_pa=198.5e9, poisson=0.29, yield_pa=265e6, density_kg_m3=7900.0)
"""Annealed 304 at 20 °C. Grade B: weld-simulation data of Brickstad and Josefson, Deng and Murakawa."""


@dataclass(frozen=True)
class HingeLaw:
    """An ideal elasto-plastic hinge, per millimetre of crease where it scales with length.

    Attributes:
        stiffness_per_mm: torque per radian and millimetre of crease, g mm²/s² / mm.
        damping_s: damping torque is this time the stiffness times the angular rate.
        yield_rad: elastic angle at which the whole section yields.
    """

    stiffness_per_mm: float
    damping_s: float
    yield_rad: float


def hinge_law(metal: SheetMetal, thickness_mm: float, bent_length_mm: float = 1.0) -> HingeLaw:
    """Hinge of a strip of ``bent_length_mm`` across the crease, bent as a wide plate.

    Stiffness ``E t^3 / (12 (1 - nu^2) L)`` and fully plastic angle ``3 (1 - nu^2) sigma_y L / (E t)``.
    Source: plate theory (Timoshenko and Woinowsky-Krieger, 1959), plastic moment ``sigma_y t^2 / 4``.

    Raises:
        ModelError: if a length is not positive.
    """
    if not (thickness_mm > 0.0 and bent_length_mm > 0.0 and math.isfinite(thickness_mm * bent_length_mm)):
        raise ModelError(f"thickness {thickness_mm} mm and bent length {bent_length_mm} mm must be positive")
    young = metal.young_pa * PASCAL
    plate = 1.0 - metal.poisson**2
    stiffness = young * thickness_mm**3 / (12.0 * plate * bent_length_mm)
    yield_rad = 3.0 * plate * metal.yield_pa * bent_length_mm / (metal.young_pa * thickness_mm)
    return HingeLaw(stiffness_per_mm=stiffness, damping_s=1e-3, yield_rad=yield_rad)
