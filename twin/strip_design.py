"""Which settings a test strip tries, and what the model expects of them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigs.errors import JobError
from rigs.material import Material
from rigs.rig import Rig
from rigs.strip import Strip
from twin.cooling import crease_rise
from twin.errors import HeatingError
from twin.heating import REGIMES, fold_passes
from twin.process_table import DESIGN_PEAK_SHARE

__all__ = ["Expected", "expected_folds", "fold_settings", "kerf_settings", "rest_between_s"]

FOLD_PASSES = (1, 5, 10, 20)
KERF_PASSES = (1,)
_SHARES = (0.5, 0.65, 0.8, 1.0)
"""Powers that are tried, over the hottest that stays safe by the model."""

_CUT_SHARES = (0.5, 0.7, 1.0, 1.4, 2.0)
"""Speeds that are tried, over that at which the rig should cut."""

_MOST_RISE_C = 10.0
_MOST_FOURIER = 0.5
"""Of speeds that are proposed: up to here there is a clear gradient."""

_MOST_ANGLE_DEG, _RESERVE = 80.0, 1.6
"""A finger must not shade its crease even if it folds so many times as far as expected."""


@dataclass(frozen=True)
class Expected:
    """What the model, uncalibrated, says of the pieces of a strip.

    Attributes:
        angle_deg: of every piece after its passes.
        regime: name of the mechanism of every piece.
        notes: what is doubtful, in words.
    """

    angle_deg: tuple[float, ...]
    regime: tuple[str, ...]
    notes: tuple[str, ...]


def fold_settings(
    rig: Rig,
    material: Material,
    thickness_mm: float,
    *,
    powers: Sequence[float] = (),
    speeds: Sequence[float] = (),
    passes: Sequence[int] = (),
    repeats: int = 1,
) -> tuple[tuple[float, float, int], ...]:
    """Power, speed and passes of every finger: all combinations, the whole set once for each repeat.

    Without speeds, two at which one pass folds far by the model; without powers, four shares of the hottest
    that keeps its distance from melting at each speed.

    Raises:
        HeatingError: if no power is safe.
        SettingError: if a value is not finite or out of range.
    """
    chosen = tuple(speeds) or _good_speeds(rig, material, thickness_mm)
    counts = tuple(passes) or FOLD_PASSES
    settings: list[tuple[float, float, int]] = []
    for speed in chosen:
        own = tuple(powers) or _safe_powers(rig, material, thickness_mm, speed)
        if not own:
            cap = rig.laser.cap_fraction * rig.laser.max_w
            raise HeatingError(
                f"no power up to {cap:.3g} W folds {thickness_mm:g} mm of {material.name} "
                f"{material.temper_name} at {speed:g} mm/s by the model: name powers and speeds yourself, or "
                "take another rig or thickness"
            )
        settings += itertools.product(own, (speed,), counts)
    return tuple(settings * repeats)


def kerf_settings(
    speed_mm_s: float,
    power_w: float,
    *,
    powers: Sequence[float] = (),
    speeds: Sequence[float] = (),
    passes: Sequence[int] = (),
    repeats: int = 1,
    fastest_mm_s: float = math.inf,
) -> tuple[tuple[float, float, int], ...]:
    """Power, speed and passes of every window, around the cut that the model expects."""
    around = tuple(dict.fromkeys(round(min(share * speed_mm_s, fastest_mm_s), 1) for share in _CUT_SHARES))
    chosen = tuple(powers) or (round(power_w, 3),), tuple(speeds) or around, tuple(passes) or KERF_PASSES
    return tuple(list(itertools.product(*chosen)) * repeats)


def expected_folds(strip: Strip, rig: Rig, material: Material, thickness_mm: float) -> Expected:
    """Angle and regime of every finger by the fast model.

    Raises:
        HeatingError: if a setting would cut, or a finger might fold so far that it shades its own crease or
            reaches the head.
        SettingError: if a setting is not possible.
    """
    pieces = strip.pieces
    share = material.absorptivity_at(rig.laser.wavelength_nm)
    table = fold_passes(
        material, thickness_mm, [p.power_w for p in pieces], [p.speed_mm_s for p in pieces],
        across_mm=rig.head.spot_mm / 2.0, absorptivity=share,
    )  # fmt: skip
    angles, regimes = [], []
    for n, piece in enumerate(pieces):
        regime = REGIMES[int(table.regime[n])]
        where = f"piece {piece.number} ({piece.power_w:g} W, {piece.speed_mm_s:g} mm/s)"
        if regime == "cuts":
            raise HeatingError(
                f"{where} would cut {thickness_mm:g} mm of {material.name}: lower the power or raise the "
                "speed"
            )
        law = (1.0 + np.arange(piece.passes) / table.half_passes[n]) ** -material.forming.fall_off
        angle = math.degrees(float(table.angle_rad[n]) * float(law.sum()))
        if _RESERVE * angle > _MOST_ANGLE_DEG:
            raise HeatingError(
                f"{where} is expected to fold by {angle:.0f} degrees in {piece.passes} passes, which may "
                f"shade its own crease: at most {_MOST_ANGLE_DEG / _RESERVE:.0f} degrees, ask for fewer "
                "passes"
            )
        angles.append(angle)
        regimes.append(regime)
    if strip.length_mm + 5.0 > rig.head.working_distance_mm:
        raise JobError(
            f"fingers of {strip.length_mm:g} mm may reach the head of rig {rig.name}, whose lowest part is "
            f"{rig.head.working_distance_mm:g} mm above the sheet: ask for shorter ones"
        )
    counted = {regime: regimes.count(regime) for regime in dict.fromkeys(regimes)}
    words = {
        "melts": "melt the surface", "below yield": "stay below yield",
        "buckling": "are too slow for a gradient", "upsetting": "are too slow for a gradient",
    }  # fmt: skip
    notes = tuple(f"by the model {k} settings {words[name]}" for name, k in counted.items() if name in words)
    return Expected(tuple(angles), tuple(regimes), notes)


def rest_between_s(strip: Strip, rig: Rig, material: Material, thickness_mm: float) -> float:
    """Time after which every finger is within ``_MOST_RISE_C`` of the room again, in s.

    The closed form of a line in a plate without end, doubled since heat leaves a finger on one side only.
    """
    share = material.absorptivity_at(rig.laser.wavelength_nm)
    line = max(1e3 * share * p.power_w / p.speed_mm_s for p in strip.pieces)
    count = np.arange(1.0, max(p.passes for p in strip.pieces) + 1.0)
    low, high = 0.0, 600.0
    for _ in range(40):
        rest = 0.5 * (low + high)
        rise = 2.0 * float(crease_rise(rest * count, line, thickness_mm, material).sum())
        low, high = (low, rest) if rise <= _MOST_RISE_C else (rest, high)
    return math.ceil(10.0 * high) / 10.0


def _good_speeds(rig: Rig, material: Material, thickness_mm: float) -> tuple[float, float]:
    """The speed, of the fastest and its halves, at which a hot safe pass folds farthest, and half of it.

    Only those with a gradient count; the fastest is taken where none has one.
    """
    fastest = min(rig.axes.max_mm_s[:2])
    best, farthest = fastest, -1.0
    for halves in range(7):
        speed = fastest / 2.0**halves
        safe = _safe_powers(rig, material, thickness_mm, speed)
        if not safe:
            continue
        table = fold_passes(
            material, thickness_mm, safe[-1], speed,
            across_mm=rig.head.spot_mm / 2.0, absorptivity=material.absorptivity_at(rig.laser.wavelength_nm),
        )  # fmt: skip
        if float(table.fourier) <= _MOST_FOURIER and float(table.angle_rad) > farthest:
            best, farthest = speed, float(table.angle_rad)
    return round(0.5 * best, 1), round(best, 1)


def _safe_powers(rig: Rig, material: Material, thickness_mm: float, speed: float) -> tuple[float, ...]:
    """Shares of the hottest power that folds and keeps its distance from melting; none if there is none."""
    cap = rig.laser.cap_fraction * rig.laser.max_w
    powers = cap * 1.03 ** -np.arange(120.0)[::-1]
    table = fold_passes(
        material, thickness_mm, powers, speed, across_mm=rig.head.spot_mm / 2.0,
        absorptivity=material.absorptivity_at(rig.laser.wavelength_nm),
    )  # fmt: skip
    safe = np.flatnonzero(
        (table.peak_top_c <= DESIGN_PEAK_SHARE * material.constants.solidus_c)
        & (table.regime != REGIMES.index("cuts"))
        & (table.power_w > table.threshold_w)
    )
    if not len(safe):
        return ()
    hottest = float(powers[safe[-1]])
    return tuple(round(share * hottest, 2) for share in _SHARES)
