"""Table of one laser setting by the section model: angle of every pass against start temperature and power.

A table takes about a second and is kept on disk. The name of its file is a hash of all that it follows from,
so it is never out of date; a file that is damaged is made anew.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import sys
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.atomic_file import write_atomic
from planner.values import content_sha256
from twin.errors import HeatingError
from twin.section_grid import Resolution
from twin.section_model import HARDENING_RATE, MODEL_NAME, SectionCase, section_passes

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

__all__ = ["TABLE_PASSES", "SectionTable", "make_table", "section_table", "table_folder"]

TABLE_PASSES = 40
"""Passes of a chain; later ones go on along the power law between half of it and its end."""

STARTS = 5
"""Start temperatures, evenly from 20 °C to the highest allowed one."""

POWER_SHARES = (0.25, 0.35, 0.45, 0.55, 0.7, 0.85, 1.0)
"""Shares of the power at which a first pass on cold metal is computed."""

_FORMAT, _VERSION = "metal-blossom/section-table", 1
_COLD_C = 20.0


@dataclass(frozen=True, eq=False)
class SectionTable:
    """What one setting does, pass after pass.

    Attributes:
        start_c: (S,) start temperatures, ascending from 20 °C.
        angle_rad: (S, P) angle of each pass of a chain in which all begin at that temperature.
        power_share: (K,) shares of the power, ascending to 1.
        power_rad: (K,) angle of a first pass on cold metal at that share.
        failures: chains in which time steps did not find their balance.
    """

    start_c: NDArray[np.float64]
    angle_rad: NDArray[np.float64]
    power_share: NDArray[np.float64]
    power_rad: NDArray[np.float64]
    failures: int

    @property
    def first_rad(self) -> float:
        """Angle of a first pass on cold metal."""
        return float(self.angle_rad[0, 0])

    def angles(self, start_c: NDArray[np.float64], done: int = 0) -> NDArray[np.float64]:
        """(N,) angles of passes that begin at ``start_c`` (N,), after ``done`` earlier ones.

        Between the temperatures of the table linear, beyond them as at its ends.
        """
        temperature = np.clip(start_c, self.start_c[0], self.start_c[-1])
        number = done + np.arange(len(temperature))
        count = self.angle_rad.shape[1]
        column = np.minimum(number, count - 1)
        upper = np.clip(np.searchsorted(self.start_c, temperature, side="right"), 1, len(self.start_c) - 1)
        low, high = self.start_c[upper - 1], self.start_c[upper]
        share = (temperature - low) / (high - low)
        inside = (1.0 - share) * self.angle_rad[upper - 1, column] + share * self.angle_rad[upper, column]
        beyond = np.maximum((number + 1.0) / count, 1.0)
        exponent = np.interp(temperature, self.start_c, self._fall_off)
        found: NDArray[np.float64] = inside * beyond**-exponent
        return found

    def angle_at_share(self, share: float) -> float:
        """Angle of a first pass on cold metal at a share of the power; 0 at no power."""
        return max(float(self._by_power(min(share, 1.0))), 0.0)

    @cached_property
    def _by_power(self) -> PchipInterpolator:
        """Angle of a first cold pass against the share of the power: monotone where the table is."""
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(np.append(0.0, self.power_share), np.append(0.0, self.power_rad))

    @cached_property
    def _fall_off(self) -> NDArray[np.float64]:
        """(S,) exponent by which passes fall off between half of a chain and its end, at least 0."""
        count = self.angle_rad.shape[1]
        middle, last = self.angle_rad[:, count // 2 - 1], self.angle_rad[:, -1]
        usable = (last > 0.0) & (middle > last)
        ratio = np.where(usable, middle / np.where(usable, last, 1.0), 1.0)
        exponent: NDArray[np.float64] = np.log(ratio) / math.log(count / (count // 2))
        return exponent


def make_table(case: SectionCase, hottest_c: float, resolution: Resolution | None = None) -> SectionTable:
    """Compute the table of a setting; ``start_c`` of the case does not count.

    Raises:
        SettingError: if a value of the case is out of range.
        HeatingError: if ``hottest_c`` is not above 20 °C.
    """
    if not (math.isfinite(hottest_c) and hottest_c > _COLD_C):
        raise HeatingError(f"the hottest start of a section table is {hottest_c:g} °C: expected above 20")
    starts = np.linspace(_COLD_C, hottest_c, STARTS)
    chains = section_passes(
        [replace(case, start_c=float(t)) for t in starts], TABLE_PASSES, resolution
    )  # fmt: skip
    weaker = section_passes(
        [replace(case, start_c=_COLD_C, power_w=s * case.power_w) for s in POWER_SHARES[:-1]], 1, resolution
    )  # fmt: skip
    first = [float(r.angle_rad[0]) for r in (*weaker, chains[0])]
    return SectionTable(
        start_c=starts,
        angle_rad=np.stack([r.angle_rad for r in chains]),
        power_share=np.array(POWER_SHARES),
        power_rad=np.array(first),
        failures=sum(not r.converged for r in (*chains, *weaker)),
    )


def section_table(case: SectionCase, hottest_c: float, *, folder: Path | None = None) -> SectionTable:
    """The table of a setting, from disk if it is there, else computed and put there.

    Args:
        case: the setting.
        hottest_c: highest start temperature, above 20 °C.
        folder: where tables are kept; the user's folder for caches if None. Where it cannot be written to,
            the table is only computed.

    Raises:
        SettingError: if a value of the case is out of range.
        HeatingError: if ``hottest_c`` is not above 20 °C.
    """
    key = _key(case, hottest_c)
    place = folder or table_folder()
    file = None if place is None else place / f"{key}.json"
    kept = None if file is None else _read(file, key)
    if kept is not None:
        return kept
    made = make_table(case, hottest_c)
    if file is not None:
        with suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            write_atomic(file, _text(made, key))
    return made


def table_folder() -> Path | None:
    """Folder of the tables in the user's folder for caches; None if there is no home."""
    given = os.environ.get("XDG_CACHE_HOME", "")
    if sys.platform == "win32":
        given = os.environ.get("LOCALAPPDATA", "")
    if Path(given).is_absolute():
        base = Path(given)
    else:
        try:
            home = Path.home()
        except RuntimeError:
            return None
        base = home / ("Library/Caches" if sys.platform == "darwin" else ".cache")
    return base / "metal-blossom" / "section-tables"


def _key(case: SectionCase, hottest_c: float) -> str:
    """Hash of everything that a table follows from."""
    return content_sha256(
        _FORMAT, _VERSION, MODEL_NAME, HARDENING_RATE, repr(Resolution()), TABLE_PASSES, STARTS,
        repr(POWER_SHARES), case.material.sha256, case.thickness_mm, case.power_w, case.speed_mm_s,
        case.spot_mm, case.absorbed_share, case.tilt_rad, case.moment_n, case.restraint, case.hardening_mpa,
        hottest_c,
    )  # fmt: skip


def _text(table: SectionTable, key: str) -> str:
    """The table as JSON; numbers are written so that they read back the same."""
    values = {
        "start_c": table.start_c.tolist(), "angle_rad": table.angle_rad.tolist(),
        "power_share": table.power_share.tolist(), "power_rad": table.power_rad.tolist(),
        "failures": table.failures,
    }  # fmt: skip
    body = json.dumps(values)
    digest = hashlib.sha256(body.encode()).hexdigest()
    return json.dumps({"format": _FORMAT, "version": _VERSION, "key": key, "sha256": digest, "table": body})


def _read(file: Path, key: str) -> SectionTable | None:
    """The table of a file; None if there is none, or it is damaged or of another setting."""
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        body = data["table"]
        if data["key"] != key or hashlib.sha256(body.encode()).hexdigest() != data["sha256"]:
            return None
        values = json.loads(body)
        return SectionTable(
            np.array(values["start_c"]), np.array(values["angle_rad"]), np.array(values["power_share"]),
            np.array(values["power_rad"]), int(values["failures"]),
        )  # fmt: skip
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
