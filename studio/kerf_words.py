"""What a table of cut windows says, in words and as JSON."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from twin.kerf_table import Kerf

__all__ = ["kerf_lines", "kerf_values"]


def kerf_lines(kerfs: tuple[Kerf, ...]) -> list[str]:
    """One line for each setting, and the quickest that always cut through."""
    lines = []
    for k in kerfs:
        name = f"{k.power_w:g} W, {k.speed_mm_s:g} mm/s, {k.passes} x"
        if not k.through:
            text = f"does not cut through (0 of {k.windows})"
        else:
            spread = f" ± {k.sigma_mm:.3f}" if math.isfinite(k.sigma_mm) else ""
            text = f"kerf {k.kerf_mm:.3f}{spread} mm, cut through {k.through} of {k.windows}"
        lines.append(f"{name:<26}{text}")
    best = _best(kerfs)
    if best is None:
        return [*lines, "note: no setting cut through every time: more power, slower, or more passes"]
    return [
        *lines,
        f"quickest that always cut through: {best.power_w:g} W, {best.speed_mm_s:g} mm/s, {best.passes} x; "
        f"set kerf_mm = {best.kerf_mm:.3f} under [head] of the rig profile",
    ]


def kerf_values(path: Path, kerfs: tuple[Kerf, ...]) -> dict[str, Any]:
    """Plain values for JSON."""
    best = _best(kerfs)
    return {
        "format": "metal-blossom/kerf",
        "version": 1,
        "table": path.name,
        "settings": [
            {
                "power_w": k.power_w, "speed_mm_s": k.speed_mm_s, "passes": k.passes, "windows": k.windows,
                "through": k.through, "kerf_mm": k.kerf_mm if k.through else None,
                "sigma_mm": k.sigma_mm if math.isfinite(k.sigma_mm) else None,
            }
            for k in kerfs
        ],
        "kerf_mm": None if best is None else best.kerf_mm,
    }  # fmt: skip


def _best(kerfs: tuple[Kerf, ...]) -> Kerf | None:
    """The quickest setting that always cut through, the weakest of equally quick ones."""
    sure = [k for k in kerfs if k.through == k.windows]
    return min(sure, key=lambda k: (k.passes / k.speed_mm_s, k.power_w), default=None)
