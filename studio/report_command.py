"""The commands that make a bundle again, from what its manifest says of every stage."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

from studio.manifest import Manifest
from studio.options import PlanOptions

__all__ = ["command_lines"]

_MESH = {"size_mm": "--size", "scale": "--scale", "faces": "--faces"}
_NET = {"base": "--base", "mesh_edit_mm": "--mesh-edit", "leave_out": "--leave-out"}
_NET_ALONE = {"method": "--method", "prove_s": "--prove"}
_SEARCH = {"seed": "--seed", "budget_s": "--budget"}
_PLAN = {
    "tilt_deg": "--tilt", "relief": "--relief", "certify": "--certify", "prefer": "--prefer",
    "start_c": "--start-temperature", "take_turns": "--take-turns", "heating": "--heating",
    "without": "--without",
}  # fmt: skip
_DEFAULTS: dict[str, Any] = {"method": "nb", "seed": 0} | {
    name: getattr(PlanOptions(), name) for name in (*_PLAN, "planner")
}


def command_lines(manifest: Manifest) -> list[str]:
    """Command lines that make the plan of a bundle again, one if ``blossom make`` can do it, else two.

    Flags at their default are left out. Files are named without their folders, profiles of the user's own by
    their copies in the bundle.
    """
    known = manifest.parameters
    mesh, net, plan = (known.get(stage, {}) for stage in ("mesh", "net", "plan"))
    name = str(mesh.get("path") or manifest.input.get("name", "MESH"))
    first = [*_flags(mesh, _MESH), *_machine(manifest), *_flags(net, _NET)]
    bends = [*_flags(plan, _PLAN)]
    if plan.get("bend_allowance") is False:
        bends += ["--bend-allowance", "off"]
    if plan.get("diagnosis") is False:
        bends += ["--no-diagnosis"]
    if not plan:
        return [_line("net", name, *first, *_flags(net, _NET_ALONE | _SEARCH))]
    alone = [*_flags(net, _NET_ALONE), *_flags(plan, {"planner": "--planner"})]
    same = all(net.get(key) == plan.get(key) for key in _SEARCH)
    if same and not alone:
        return [_line("make", name, *first, *bends, *_flags(net, _SEARCH))]
    search = [*_flags(plan, {"budget_s": "--budget"})]
    if net.get("seed") != plan.get("seed"):
        search += ["--seed", str(plan.get("seed"))]
    return [
        _line("net", name, "-o", "DIR", *first, *_flags(net, _NET_ALONE | _SEARCH)),
        _line("plan", "DIR", *_flags(plan, {"planner": "--planner"}), *bends, *search),
    ]


def _line(*words: str) -> str:
    return shlex.join(["blossom", *words])


def _flags(values: Mapping[str, Any], flags: Mapping[str, str]) -> list[str]:
    out: list[str] = []
    for key, flag in flags.items():
        value = values.get(key)
        if value is None or value is False or value == _DEFAULTS.get(key) or value in ([], ()):
            continue
        out.append(flag)
        if isinstance(value, list | tuple):
            out += [str(item) for item in value]
        elif value is not True:
            out.append(f"{value:g}" if isinstance(value, float) else str(value))
    return out


def _machine(manifest: Manifest) -> list[str]:
    from rigs.material import material_names
    from rigs.rig import rig_names

    rig, material = str(manifest.rig.get("name", "")), str(manifest.material.get("name", ""))
    out = ["--rig", rig if rig in rig_names() else "rig.toml"]
    out += ["--material", material if material in material_names() else "material.toml"]
    thickness = manifest.material.get("thickness_mm")
    return [*out, "--thickness", f"{float(thickness):g}"] if thickness is not None else out
