"""``blossom rigs``: list, show, check and probe machines."""

from __future__ import annotations

import json as json_text
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from studio.commands_lists import list_of, say
from studio.errors import UsageError
from studio.exit_codes import DONE, NO
from studio.flags import Json

__all__ = ["rigs"]


def rigs(
    what: Annotated[
        Literal["list", "show", "check", "probe"],
        Parameter(metavar="list|show|check|probe", show_default=False, help="What to do [list]."),
    ] = "list",
    rig: Annotated[
        str | None, Parameter(metavar="NAME|FILE", help="A shipped machine by name, or a profile file.")
    ] = None,
    /,
    *,
    port: Annotated[
        str | None,
        Parameter(
            metavar="URL", help="probe: emulator, /dev/ttyUSB0, COM3 or socket://HOST:PORT [of the rig]."
        ),
    ] = None,
    json: Json = False,
) -> int:
    """List the machines that come with the product, show one, check a profile, or compare it with a machine.

    check names every mistake of a profile and what follows from it. probe asks a machine who it is and how
    it is set, and
    says where it differs from the profile; nothing but questions is sent, nothing moves.

    Examples:
        blossom rigs

        blossom rigs check my-rig.toml

        blossom rigs probe my-rig.toml --port /dev/ttyUSB0
    """
    if what == "list":
        if rig is not None or port is not None:
            raise UsageError(
                "blossom rigs list takes no machine and no port; did you mean blossom rigs show?"
            )
        return _list(json)
    if rig is None:
        raise UsageError(f"blossom rigs {what} needs a machine: a name (see blossom rigs) or a profile file")
    if port is not None and what != "probe":
        raise UsageError("--port is for blossom rigs probe")
    return {"show": _show, "check": _check}[what](rig, json) if what != "probe" else _probe(rig, port, json)


def _list(as_json: bool) -> int:
    from rigs.rig import load_rig, rig_names

    rows = []
    for name in rig_names():
        rig = load_rig(name)
        grades = sorted({grade.grade for grade in rig.grades.values()})
        rows.append(
            {
                "name": name,
                "laser": f"{rig.laser.max_w:g} W, {rig.laser.wavelength_nm:g} nm",
                "area": f"{rig.sheet.max_mm[0]:g} x {rig.sheet.max_mm[1]:g} mm",
                "tilt": f"{rig.head.max_incidence_deg:g}°",
                "controller": rig.controller.dialect,
                "grades": "".join(grades),
            }
        )
    return list_of("rigs", rows, as_json, "graded A measured, B literature, C guess")


def _show(name: str, as_json: bool) -> int:
    import msgspec

    from rigs.rig import load_rig

    rig = load_rig(name)
    values: dict[str, Any] = msgspec.to_builtins(rig)
    if as_json:
        _print({"format": "metal-blossom/rig", "version": 1, "sha256": rig.sha256, "rig": values})
        return DONE
    grades = values.pop("grades")
    say(f"{rig.name}: {rig.rig.notes}")
    for section, content in values.items():
        if section in ("schema", "rig"):
            continue
        grade = grades.get(section)
        say(f"\n[{section}]" + (f"   {grade['grade']}: {grade['source']}" if grade else ""))
        for key, value in content.items():
            say(f"{key:<22}{_text(value)}")
    say(f"\nsha256                {rig.sha256}")
    return DONE


def _check(name: str, as_json: bool) -> int:
    from rigs.rig import load_rig, rig_mistakes
    from rigs.rig_facts import rig_facts

    mistakes = rig_mistakes(name)
    facts = {} if mistakes else rig_facts(load_rig(name))
    if as_json:
        _print({
            "format": "metal-blossom/rig-check", "version": 1, "rig": name, "mistakes": list(mistakes),
            "facts": facts,
        })  # fmt: skip
        return NO if mistakes else DONE
    for mistake in mistakes:
        say(mistake)
    if mistakes:
        say(f"\n{name}: {len(mistakes)} mistake{'s' if len(mistakes) > 1 else ''}")
        return NO
    say(f"{name}: no mistake found. What follows from it:")
    for key, value in facts.items():
        stem, _, unit = key.rpartition("_")
        shown = {"mm": "mm", "w": "W", "s": "s", "deg": "°"}.get(unit, "")
        if key == "largest_s":
            stem, shown = "largest S word", ""
        say(f"{stem.replace('_', ' '):<22}{value:.4g}{'' if shown == '°' else ' '}{shown}".rstrip())
    return DONE


def _probe(name: str, port: str | None, as_json: bool) -> int:
    from rigs.emulator import start_emulator
    from rigs.probe import probe
    from rigs.rig import load_rig
    from studio.replay_stage import EMULATOR

    rig = load_rig(name)
    url = port or rig.controller.url
    if url == EMULATOR:
        with start_emulator(name) as machine:
            found = probe(machine.url, rig)
    else:
        found = probe(url, rig)
    mark = "EMULATED" if found.identity.emulated else "REAL"
    if as_json:
        _print({
            "format": "metal-blossom/rig-probe", "version": 1, "rig": rig.name, "url": url, "machine": mark,
            "state": found.status.state, "info": list(found.identity.info),
            "settings": found.identity.settings, "mistakes": list(found.mistakes),
        })  # fmt: skip
        return NO if found.mistakes else DONE
    say(f"{mark} machine at {url}, state {found.status.state}")
    for line in found.identity.info:
        say(f"  {line}")
    for mistake in found.mistakes:
        say(f"differs: {mistake}")
    say(
        f"{len(found.mistakes)} differences from {rig.name}: it would not be armed"
        if found.mistakes
        else f"agrees with {rig.name}"
    )
    return NO if found.mistakes else DONE


def _text(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{k} = {_text(v)}" for k, v in value.items()) or "-"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_text(v) for v in value) + "]"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _print(values: dict[str, Any]) -> None:
    say(json_text.dumps(values, ensure_ascii=False, allow_nan=False))
