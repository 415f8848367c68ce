"""``blossom check``, and what commands that only tell something share."""

from __future__ import annotations

import json as json_text
from typing import Any

from studio.flags import Json, MachineFlags, Mesh, MeshFlags
from studio.progress import Progress

__all__ = ["check", "list_of", "say"]


def say(text: str) -> None:
    """Print a line of the answer."""
    print(text)  # noqa: T201  command output


def check(
    mesh: Mesh,
    /,
    *,
    read: MeshFlags = MeshFlags(),  # noqa: B008  frozen
    machine: MachineFlags = MachineFlags(),  # noqa: B008  frozen
    json: Json = False,
) -> int:
    """Say whether a mesh can be used, and what was repaired.

    Examples:
        blossom check bunny.obj

        blossom check scan.stl --size 60 --faces 300
    """
    from planner.mesh_facts import describe_mesh
    from planner.read_goal import read_goal
    from rigs.limits import machine_limits
    from rigs.material import load_material
    from rigs.rig import load_rig

    chosen = machine.options()
    limits = machine_limits(load_rig(chosen.rig), load_material(chosen.material), chosen.thickness_mm)
    with Progress(quiet=json).stage("mesh", f"reading {mesh.name}"):
        goal = read_goal(mesh, size_mm=read.size, scale=read.scale, max_faces=read.faces, limits=limits)
    figures = describe_mesh(goal)
    if json:
        say(json_text.dumps(figures, ensure_ascii=False, allow_nan=False))
        return 0
    say(f"{mesh.name} can be used.")
    for name, value in figures.items():
        if name not in ("name", "notices"):
            say(f"{_label(name):<26}{_text(value)}")
    for notice in goal.notices:
        say(f"note: {notice}")
    return 0


def list_of(kind: str, rows: list[dict[str, Any]], as_json: bool, foot: str) -> int:
    """Print rows as a table with a line under it, or as one JSON object."""
    if as_json:
        document = {"format": f"metal-blossom/{kind}", "version": 1, kind: rows}
        say(json_text.dumps(document, ensure_ascii=False))
        return 0
    names = list(rows[0])
    widths = [max(len(name), *(len(str(row[name])) for row in rows)) for name in names]
    say("  ".join(name.ljust(width) for name, width in zip(names, widths, strict=True)).rstrip())
    for row in rows:
        cells = (str(row[name]).ljust(width) for name, width in zip(names, widths, strict=True))
        say("  ".join(cells).rstrip())
    say(f"\n{foot}")
    return 0


def _label(name: str) -> str:
    for unit, shown in (("_mm3", ", mm³"), ("_mm2", ", mm²"), ("_mm", ", mm"), ("_deg", ", degrees")):
        if name.endswith(unit):
            return name.removesuffix(unit).replace("_", " ") + shown
    return name.replace("_", " ")


def _text(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, list):
        return " x ".join(_text(v) for v in value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1000 else f"{value:.0f}"
    return str(value)
