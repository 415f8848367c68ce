"""What one laser setting does to one sheet, by either heating model: the answer behind ``blossom bend``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rigs.material import Material
from twin.errors import SettingError
from twin.heating import MODEL_NAME as FAST_NAME
from twin.heating import PassResult, bend
from twin.section_model import MODEL_NAME as SECTION_NAME
from twin.section_model import section_bend

__all__ = ["MOST_PASSES", "BendAnswer", "Model", "bend_answer"]

Model = Literal["fast", "section"]

MOST_PASSES = 200
"""More passes of one setting are refused."""

LARGEST_BEND_DEG = 150.0
"""Beyond it the flange shades its own crease and the small-strain section says nothing."""


@dataclass(frozen=True)
class BendAnswer:
    """Angle, regime and temperatures of a setting.

    Attributes:
        model: name and version of the heating model.
        angle_deg: after all passes, towards the laser; None where the model cannot say.
        pass_deg: of each pass; empty where the model cannot say.
        one: regime, threshold, Fourier number and peak temperatures.
        valid: the angle may be used for folding.
        flags: what is doubtful or wrong, in words.
        flange_s: times since the beam entered the crease, first pass (section model only).
        flange_deg: angle of the flange at these times.
    """

    model: str
    angle_deg: float | None
    pass_deg: tuple[float, ...]
    one: PassResult
    valid: bool
    flags: tuple[str, ...]
    flange_s: tuple[float, ...]
    flange_deg: tuple[float, ...]


def bend_answer(
    material: Material,
    thickness_mm: float,
    power_w: float,
    speed_mm_s: float,
    spot_mm: float,
    *,
    absorptivity: float,
    passes: int = 1,
    tilt_deg: float = 0.0,
    start_c: float = 20.0,
    moment_n: float = 0.0,
    along_mm: float = 10.0,
    model: Model = "section",
) -> BendAnswer:
    """Passes of one setting, each from the same start temperature.

    Args:
        material: what the sheet is made of, in the temper that is used.
        thickness_mm: of the sheet.
        power_w: laser power.
        speed_mm_s: along the crease.
        spot_mm: 1/e² diameter of the beam.
        absorptivity: absorbed share of the light, above 0 up to 1.
        passes: how many, 1 to ``MOST_PASSES``.
        tilt_deg: between beam and sheet normal, across the crease.
        start_c: temperature before each pass.
        moment_n: moment per length that the hinge carries, N mm/mm (section model only).
        along_mm: length of the crease, for the flange over time.
        model: ``fast`` is the closed form, ``section`` the layered section.

    Raises:
        SettingError: if a value is not finite or out of range.
    """
    if not 1 <= passes <= MOST_PASSES:
        raise SettingError(f"expected 1 to {MOST_PASSES} passes, got {passes}")
    if not math.isfinite(tilt_deg):
        raise SettingError(f"tilt must be 0 to below 85 degrees, got {tilt_deg:g}")
    tilt = math.radians(tilt_deg)
    if model == "fast":
        one = bend(
            material, thickness_mm, power_w, speed_mm_s, spot_mm=spot_mm, absorptivity=absorptivity,
            tilt_rad=tilt, start_c=start_c,
        )  # fmt: skip
        fade = (1.0 + np.arange(passes) / one.half_passes) ** -material.forming.fall_off
        degrees = np.degrees(one.angle_rad * fade)
        known, valid, flags = one.regime not in ("cuts", "melts"), one.valid, one.flags
        time_s: tuple[float, ...] = ()
        flange_deg: tuple[float, ...] = ()
        name = FAST_NAME
    else:
        result = section_bend(
            material, thickness_mm, power_w, speed_mm_s, spot_mm, absorptivity=absorptivity, start_c=start_c,
            tilt_rad=tilt, moment_n=moment_n, passes=passes, along_mm=along_mm,
        )  # fmt: skip
        one, degrees = result.fast, np.degrees(result.angle_rad)
        known, valid, flags = (
            result.converged and one.regime not in ("cuts", "melts"), result.valid, result.flags
        )  # fmt: skip
        time_s = tuple(result.flange_time_s.tolist())
        flange_deg = tuple(np.degrees(result.flange_rad).tolist())
        name = SECTION_NAME
    total = float(degrees.sum())
    if known and abs(total) > LARGEST_BEND_DEG:
        flags = (*flags, f"more than {LARGEST_BEND_DEG:g} degrees: outside the small-strain model")
        valid = False
    return BendAnswer(
        model=name,
        angle_deg=total if known else None,
        pass_deg=tuple(degrees.tolist()) if known else (),
        one=one,
        valid=valid and known,
        flags=flags,
        flange_s=time_s if known else (),
        flange_deg=flange_deg if known else (),
    )
