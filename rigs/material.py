"""Material profiles: temperature tables, absorptivity and temper, each value with its source and grade."""

from __future__ import annotations

import bisect
import hashlib
import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import msgspec

from rigs.errors import ProfileError, UnknownNameError
from rigs.profile_text import all_mistakes, parse_profile, profile_names, profile_text
from rigs.rig import Grade, Profile

__all__ = [
    "Absorptivity", "Calibration", "Constants", "Forming", "Material", "MaterialName", "Table", "Temper",
    "load_material", "material_mistakes", "material_names", "parse_material",
]  # fmt: skip

TABLE_COLUMNS = (
    "conductivity_w_mk", "heat_capacity_j_kgk", "young_gpa", "yield_mpa", "expansion_1e6_k",
)  # fmt: skip
"""Columns of the temperature table, in the order of the files."""

FOLDER = "materials"

NAMED_GRADES = ("constants", "absorptivity", "table", "forming")
"""Sections that must say how well their values are known."""


class MaterialName(Profile, frozen=True, kw_only=True):
    """``[material]``: short name, title, and the temper that is meant when none is named."""

    name: str
    title: str
    temper: str
    notes: str = ""


class Constants(Profile, frozen=True, kw_only=True):
    """``[constants]``: values without a temperature column.

    Attributes:
        density_kg_m3: at 20 °C.
        poisson: Poisson's ratio.
        solidus_c: temperature at which it begins to melt.
        latent_heat_kj_kg: heat of fusion.
        anneal_c: temperature at which work hardening is lost within a laser pass.
        emissivity: of the surface, for heat losses.
    """

    density_kg_m3: float
    poisson: float
    solidus_c: float
    latent_heat_kj_kg: float
    anneal_c: float
    emissivity: float = 0.4


class Absorptivity(Profile, frozen=True, kw_only=True):
    """``[absorptivity]``: absorbed share of laser light. Oxide and roughness decide: calibrate it.

    Attributes:
        at_1064nm: near infrared (fibre, Nd:YAG).
        at_10600nm: CO2 lasers.
    """

    at_1064nm: float
    at_10600nm: float


class Table(Profile, frozen=True, kw_only=True):
    """``[table]``: properties against temperature, for the first temper of the file.

    Attributes:
        temperature_c: rising.
        conductivity_w_mk: thermal conductivity.
        heat_capacity_j_kgk: specific heat.
        young_gpa: Young's modulus.
        yield_mpa: yield stress.
        expansion_1e6_k: mean expansion coefficient from 20 °C.
    """

    temperature_c: tuple[float, ...]
    conductivity_w_mk: tuple[float, ...]
    heat_capacity_j_kgk: tuple[float, ...]
    young_gpa: tuple[float, ...]
    yield_mpa: tuple[float, ...]
    expansion_1e6_k: tuple[float, ...]


class Temper(Profile, frozen=True, kw_only=True):
    """``[temper.NAME]``: yield stress at 20 °C, with its source. Hot, all tempers end as the annealed one."""

    yield_mpa: float
    grade: Literal["A", "B", "C"]
    source: str


class Forming(Profile, frozen=True, kw_only=True):
    """``[forming]``: what a calibration fits, and the defaults while there is none.

    Attributes:
        gain: factor on the angle of a pass.
        threshold: factor on the power of first yield.
        fall_off: exponent q of the pass law ``(1 + (n - 1) / n_h) ** -q``.
        half_passes: n_h where the bottom reaches ``half_heat`` of the way to the anneal temperature.
        half_heat: that share.
        half_exponent: how steeply n_h rises with that share (metal that anneals itself hardens less).
        neutral_share: how far beyond the middle of the sheet, away from the beam, the fibre lies that keeps
            its length when a crease bends, as a share of the thickness.
        scatter_sheet: relative scatter of the angle from sheet to sheet.
        scatter_crease: from crease to crease.
        scatter_pass: from pass to pass.
    """

    gain: float = 1.0
    threshold: float = 1.0
    fall_off: float = 1.0
    half_passes: float = 83.0
    half_heat: float = 0.316
    half_exponent: float = 6.4
    neutral_share: float = 1.0 / 3.0
    scatter_sheet: float = 0.10
    scatter_crease: float = 0.05
    scatter_pass: float = 0.08


class Calibration(Profile, frozen=True, kw_only=True):
    """``[calibration]``: whether angles were fitted to a burnt table.

    Attributes:
        status: ``none`` until a table was fitted.
        source: what was fitted, when, on which machine.
        thickness_mm: of the sheets that were burnt; empty if not known.
        wavelength_nm: of the laser that burnt them; 0 if not known.
    """

    status: Literal["none", "fitted"] = "none"
    source: str = ""
    thickness_mm: tuple[float, ...] = ()
    wavelength_nm: float = 0.0


class Material(Profile, frozen=True, kw_only=True):
    """A sheet metal, with the temper that is used."""

    schema: Literal[1] = 1
    material: MaterialName
    constants: Constants
    absorptivity: Absorptivity
    table: Table
    temper: dict[str, Temper]
    forming: Forming = Forming()
    calibration: Calibration = Calibration()
    grades: dict[str, Grade]

    @property
    def name(self) -> str:
        """Short name, such as ``304``."""
        return self.material.name

    @property
    def temper_name(self) -> str:
        """The temper that is used."""
        return self.material.temper

    @property
    def sha256(self) -> str:
        """SHA-256 of the canonical JSON of all values (titles, notes, sources and grades do not count)."""
        data: dict[str, Any] = msgspec.to_builtins(self)
        del data["grades"], data["material"]["notes"], data["material"]["title"]
        for temper in data["temper"].values():
            del temper["grade"], temper["source"]
        return hashlib.sha256(msgspec.json.encode(data, order="deterministic")).hexdigest()

    @property
    def young_pa(self) -> float:
        """Young's modulus at 20 °C, Pa."""
        return 1e9 * self.value("young_gpa", 20.0)

    @property
    def poisson(self) -> float:
        """Poisson's ratio."""
        return self.constants.poisson

    @property
    def density_kg_m3(self) -> float:
        """Density, kg/m³."""
        return self.constants.density_kg_m3

    @property
    def yield_pa(self) -> float:
        """Yield stress of the used temper at 20 °C, Pa."""
        return 1e6 * self.temper[self.temper_name].yield_mpa

    @property
    def neutral_share(self) -> float:
        """Neutral fibre beyond the middle of the sheet, away from the beam, as a share of the thickness.

        The default follows from the two-layer model of Vollertsen, Lasers in Engineering 2 (1994) 261: if the
        lit part s of the thickness h shrinks evenly, shortening over bend angle is h² / 6 (h - s), which is
        h / 3 for the model's s = h / 2, and h / 6 for a thin lit layer. Grade C.
        """
        return self.forming.neutral_share

    @property
    def scatter(self) -> tuple[float, float, float]:
        """Relative scatter of the angle from sheet to sheet, crease to crease and pass to pass."""
        return self.forming.scatter_sheet, self.forming.scatter_crease, self.forming.scatter_pass

    def value(self, column: str, temperature_c: float) -> float:
        """A column of the table at a temperature: linear between rows, constant beyond them."""
        x, y = self.table.temperature_c, getattr(self.table, column)
        if temperature_c <= x[0]:
            return float(y[0])
        if temperature_c >= x[-1]:
            return float(y[-1])
        i = bisect.bisect_right(x, temperature_c) - 1
        return float(y[i] + (y[i + 1] - y[i]) * (temperature_c - x[i]) / (x[i + 1] - x[i]))

    def yield_mpa_at(self, temperature_c: float) -> float:
        """Yield stress of the used temper, MPa: its lead over the table fades until it is annealed."""
        cold = self.temper[self.temper_name].yield_mpa - self.value("yield_mpa", 20.0)
        left = (self.constants.anneal_c - temperature_c) / (self.constants.anneal_c - 20.0)
        table = self.value("yield_mpa", temperature_c)
        return max(table + cold * min(max(left, 0.0), 1.0), 0.1 * table)

    def absorptivity_at(self, wavelength_nm: float) -> float:
        """Absorbed share of light near 1.06 µm or 10.6 µm.

        Raises:
            ProfileError: for other wavelengths, for which the profile has no value.
        """
        if 900.0 <= wavelength_nm <= 1200.0:
            return self.absorptivity.at_1064nm
        if 9000.0 <= wavelength_nm <= 11000.0:
            return self.absorptivity.at_10600nm
        raise ProfileError(
            f"material {self.name}: no absorptivity for {wavelength_nm:g} nm: the profile holds 900 to 1200 "
            "nm and 9000 to 11000 nm"
        )

    def with_temper(self, name: str) -> Material:
        """The same metal in another temper.

        Raises:
            UnknownNameError: if the profile has no such temper.
        """
        if name not in self.temper:
            raise UnknownNameError("temper", name, self.temper)
        return msgspec.structs.replace(self, material=msgspec.structs.replace(self.material, temper=name))


def material_names() -> tuple[str, ...]:
    """Names of the shipped materials, sorted."""
    return profile_names(FOLDER)


def load_material(name_or_path: str | Path) -> Material:
    """Load a shipped material by name (``304``, or ``304/full-hard`` for a temper), or a profile by path.

    Raises:
        UnknownNameError: no shipped material or temper has the name.
        ProfileError: the file cannot be read or a value in it is wrong; the message names the place.
    """
    name, slash, temper = str(name_or_path).partition("/")
    if isinstance(name_or_path, str) and slash and name in material_names() and not temper.endswith(".toml"):
        return load_material(name).with_temper(temper)
    return parse_material(*profile_text("material", FOLDER, name_or_path))


def parse_material(text: str, source: str = "material profile") -> Material:
    """Read a profile from TOML text; ``source`` names it in messages.

    Raises:
        ProfileError: with the path of the wrong value, such as ``$.absorptivity.at_1064nm``.
    """
    return parse_profile(text, Material, _mistakes, source)


def material_mistakes(name_or_path: str | Path) -> tuple[str, ...]:
    """Every mistake of a profile in words; empty if it can be used.

    Raises:
        UnknownNameError: no shipped material has the name.
        ProfileError: the file cannot be read.
    """
    text, source = profile_text("material", FOLDER, name_or_path)
    return all_mistakes(text, Material, _mistakes, source)


def _mistakes(material: Material) -> Iterator[str]:
    """Every mistake that needs more than the type of a value, as ``$.place: what, and what to do``."""
    constants = material.constants
    for name in ("density_kg_m3", "latent_heat_kj_kg"):
        if getattr(constants, name) <= 0.0:
            yield f"$.constants.{name}: must be more than 0, got {getattr(constants, name)}"
    if not 0.0 <= constants.poisson < 0.5:
        yield f"$.constants.poisson: expected 0 to below 0.5, got {constants.poisson}"
    if not 20.0 < constants.anneal_c < constants.solidus_c:
        yield (
            f"$.constants.anneal_c: expected more than 20 and less than solidus_c = {constants.solidus_c:g}, "
            f"got {constants.anneal_c:g}"
        )
    for name, value in (
        ("absorptivity.at_1064nm", material.absorptivity.at_1064nm),
        ("absorptivity.at_10600nm", material.absorptivity.at_10600nm),
        ("constants.emissivity", constants.emissivity),
    ):
        if not 0.0 < value <= 1.0:
            yield f"$.{name}: expected a share above 0 up to 1, got {value}"
    yield from _table_mistakes(material.table)
    if material.temper_name not in material.temper:
        yield f"$.material.temper: '{material.temper_name}' is none of [{', '.join(sorted(material.temper))}]"
    for name, temper in material.temper.items():
        if temper.yield_mpa <= 0.0:
            yield f"$.temper.{name}.yield_mpa: must be more than 0, got {temper.yield_mpa}"
    forming = material.forming
    for name in ("gain", "threshold", "half_passes", "half_heat"):
        if getattr(forming, name) <= 0.0:
            yield f"$.forming.{name}: must be more than 0, got {getattr(forming, name)}"
    for name in ("fall_off", "half_exponent", "scatter_sheet", "scatter_crease", "scatter_pass"):
        if getattr(forming, name) < 0.0:
            yield f"$.forming.{name}: must not be negative, got {getattr(forming, name)}"
    if not 0.0 <= forming.neutral_share <= 1.0:
        yield f"$.forming.neutral_share: expected a share from 0 to 1, got {forming.neutral_share}"
    calibration = material.calibration
    if any(not h > 0.0 for h in calibration.thickness_mm):
        yield f"$.calibration.thickness_mm: every value must be more than 0, got {calibration.thickness_mm}"
    if calibration.wavelength_nm < 0.0:
        yield f"$.calibration.wavelength_nm: must not be negative, got {calibration.wavelength_nm}"
    for name in NAMED_GRADES:
        if name not in material.grades:
            yield f"$.grades.{name}: say grade and source of these values"


def _table_mistakes(table: Table) -> Iterator[str]:
    rows = len(table.temperature_c)
    if rows < 2:
        yield f"$.table.temperature_c: expected at least two temperatures, got {rows}"
    if any(b <= a for a, b in itertools.pairwise(table.temperature_c)):
        yield "$.table.temperature_c: temperatures must rise from row to row"
    for name in TABLE_COLUMNS:
        column = getattr(table, name)
        if len(column) != rows:
            yield f"$.table.{name}: {len(column)} values for {rows} temperatures"
        elif any(not (math.isfinite(v) and v > 0.0) for v in column):
            yield f"$.table.{name}: every value must be more than 0"
