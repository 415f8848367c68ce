"""``blossom materials``: list, show and check sheet metals."""

from __future__ import annotations

import json as json_text
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from studio.commands_lists import list_of, say
from studio.errors import UsageError
from studio.exit_codes import DONE, NO
from studio.flags import Json

__all__ = ["materials"]

_UNITS = {
    "density_kg_m3": "kg/m³", "solidus_c": "°C", "anneal_c": "°C", "latent_heat_kj_kg": "kJ/kg",
    "yield_mpa": "MPa",
}  # fmt: skip

_COLUMNS = {
    "temperature_c": "°C", "conductivity_w_mk": "k W/mK", "heat_capacity_j_kgk": "c_p J/kgK",
    "young_gpa": "E GPa", "yield_mpa": "yield MPa", "expansion_1e6_k": "α 1e-6/K",
}  # fmt: skip


def materials(
    what: Annotated[
        Literal["list", "show", "check"],
        Parameter(metavar="list|show|check", show_default=False, help="What to do [list]."),
    ] = "list",
    material: Annotated[
        str | None,
        Parameter(
            metavar="NAME|FILE", help="A shipped metal by name (304, 304/full-hard), or a profile file."
        ),
    ] = None,
    /,
    *,
    json: Json = False,
) -> int:
    """List the sheet metals that come with the product, show one, or check a profile.

    show prints every figure with its grade and source: A measured, B literature, C guess. check names every
    mistake of a profile with its place.

    Examples:
        blossom materials

        blossom materials show 304/full-hard

        blossom materials check my-sheet.toml
    """
    if what == "list":
        if material is not None:
            raise UsageError("blossom materials list takes no metal; did you mean blossom materials show?")
        return _list(json)
    if material is None:
        raise UsageError(
            f"blossom materials {what} needs a metal: a name (see blossom materials) or a profile file"
        )
    return _show(material, json) if what == "show" else _check(material, json)


def _list(as_json: bool) -> int:
    from rigs.material import load_material, material_names

    rows = []
    for name in material_names():
        material = load_material(name)
        rows.append(
            {
                "name": name,
                "temper": material.temper_name,
                "stiffness": f"{material.young_pa / 1e9:.0f} GPa",
                "yield": f"{material.yield_pa / 1e6:.0f} MPa",
                "density": f"{material.density_kg_m3:.0f} kg/m³",
                "grades": "".join(sorted({grade.grade for grade in material.grades.values()})),
            }
        )
    return list_of("materials", rows, as_json, "graded A measured, B literature, C guess")


def _show(name: str, as_json: bool) -> int:
    import msgspec

    from rigs.material import load_material

    material = load_material(name)
    values: dict[str, Any] = msgspec.to_builtins(material)
    if as_json:
        document = {
            "format": "metal-blossom/material", "version": 1, "sha256": material.sha256, "material": values
        }  # fmt: skip
        say(json_text.dumps(document, ensure_ascii=False, allow_nan=False))
        return DONE
    grades = values["grades"]
    notes = f"; {material.material.notes}" if material.material.notes else ""
    say(f"{material.name}: {material.material.title}, {material.temper_name}{notes}")
    for section in ("constants", "absorptivity", "table", "temper", "forming", "calibration"):
        grade = grades.get(section)
        say(f"\n[{section}]" + (f"   {grade['grade']}: {grade['source']}" if grade else ""))
        if section == "table":
            _table(values[section])
        elif section == "temper":
            for temper, entry in values[section].items():
                used = " (used)" if temper == material.temper_name else ""
                figures = f"{entry['yield_mpa']:g} MPa   {entry['grade']}: {entry['source']}"
                say(f"{temper + used:<22}{figures}")
        else:
            for key, value in values[section].items():
                say(f"{key:<22}{_text(value)} {_UNITS.get(key, '')}".rstrip())
    say(f"\nsha256                {material.sha256}")
    return DONE


def _table(columns: dict[str, list[float]]) -> None:
    say("".join(f"{title:>11}" for title in _COLUMNS.values()))
    for row in zip(*(columns[name] for name in _COLUMNS), strict=True):
        say("".join(f"{value:>11g}" for value in row))


def _check(name: str, as_json: bool) -> int:
    from rigs.material import material_mistakes

    mistakes = material_mistakes(name)
    if as_json:
        document = {
            "format": "metal-blossom/material-check", "version": 1, "material": name,
            "mistakes": list(mistakes),
        }  # fmt: skip
        say(json_text.dumps(document, ensure_ascii=False, allow_nan=False))
        return NO if mistakes else DONE
    for mistake in mistakes:
        say(mistake)
    if mistakes:
        say(f"\n{name}: {len(mistakes)} mistake{'s' if len(mistakes) > 1 else ''}")
        return NO
    say(f"{name}: no mistake found")
    return DONE


def _text(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(_text(v) for v in value) or "-"
    return f"{value:g}" if isinstance(value, int | float) else str(value) or "-"
