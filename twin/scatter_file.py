"""Scatter in plain values, as validation.json and ``blossom scatter --json`` hold it: angles in degrees."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from twin.scatter import HitPair, ScatterResult, Spread
from twin.scatter_shares import CreaseShare

__all__ = ["read_scatter", "scatter_values"]


def scatter_values(result: ScatterResult) -> dict[str, Any]:
    """The result in plain values, angles in degrees."""
    data = asdict(result)
    for name in ("open_loop", "touched_up"):
        spread = data[name]
        if spread is None:
            del data[name]
            continue
        spread["angle_error"] = [_degrees(a) for a in spread.pop("angle_error_rad")]
        spread["interval"] = list(spread["interval"])
    for crease in data["creases"]:
        crease["sigma"] = _degrees(crease.pop("sigma_rad"))
        crease["mm_per_degree"] = round(math.radians(crease.pop("mm_per_rad")), 9)
    data["weakest_creases"] = list(result.weakest_creases)
    return data


def read_scatter(data: Mapping[str, Any]) -> ScatterResult:
    """The result from plain values.

    Raises:
        KeyError, TypeError, ValueError: if something is missing or is not what it should be.
    """
    touched = data.get("touched_up")
    return ScatterResult(
        draws=int(data["draws"]), seed=int(data["seed"]), tolerance_rel=float(data["tolerance_rel"]),
        planned_rms_mm=float(data["planned_rms_mm"]), open_loop=_read_spread(data["open_loop"]),
        touched_up=None if touched is None else _read_spread(touched),
        sheet_share=float(data["sheet_share"]),
        creases=tuple(
            CreaseShare(
                int(c["crease"]), float(c["share"]), math.radians(c["sigma"]),
                math.degrees(c["mm_per_degree"]),
            )
            for c in data["creases"]
        ),
        expected_rms_mm=float(data["expected_rms_mm"]),
    )  # fmt: skip


def _read_spread(data: Mapping[str, Any]) -> Spread:
    low, middle, high = data["angle_error"]
    least, most = data["interval"]
    return Spread(
        float(data["probability"]), (float(least), float(most)), float(data["in_tolerance"]),
        float(data["contact_free"]), float(data["sheet_hits"]), float(data["seam_touches"]),
        tuple(data["shape_rms_mm"]), tuple(data["shape_rms_rel"]),
        (math.radians(low), math.radians(middle), math.radians(high)),
        float(data["passes"]), tuple(HitPair(**pair) for pair in data["pairs"]),
    )  # fmt: skip


def _degrees(angle_rad: float) -> float:
    """Degrees to 1e-9, so that reading and writing again gives the same bytes."""
    return round(math.degrees(angle_rad), 9)
