"""What a user may choose, as plain values: one small class per stage."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

__all__ = [
    "DEFAULT_MATERIAL", "DEFAULT_RIG", "METHODS", "PROVE_S", "MachineOptions", "MeshOptions", "NetOptions",
    "PlanOptions", "option_text",
]  # fmt: skip

DEFAULT_RIG = "grbl-4axis"
DEFAULT_MATERIAL = "304"
METHODS = (
    "nb", "exact", "steepest", "dijkstra", "bfs", "steepest-random", "flat-tree", "unflat-tree", "random",
    "ga",
)  # fmt: skip
"""Methods that find a net; the planner has the same list."""
PROVE_S = 30.0
"""Seconds for a proof where none are given."""


@dataclass(frozen=True)
class MachineOptions:
    """Machine and sheet.

    Attributes:
        rig: name of a shipped rig or path of a profile.
        material: name of a shipped material or path of a profile.
        thickness_mm: of the sheet; None takes the rig's usual thickness.
    """

    rig: str = DEFAULT_RIG
    material: str = DEFAULT_MATERIAL
    thickness_mm: float | None = None


@dataclass(frozen=True)
class MeshOptions:
    """How the mesh is read.

    Attributes:
        path: the file.
        size_mm: wanted longest side; None keeps the size.
        scale: factor; None keeps the size.
        faces: most faces; a finer mesh is coarsened. None refuses meshes that are too fine.
    """

    path: Path
    size_mm: float | None = None
    scale: float | None = None
    faces: int | None = None


@dataclass(frozen=True)
class NetOptions:
    """How the net is made.

    Attributes:
        method: of the net search.
        base: the base face; None chooses.
        prove_s: look for so many seconds for a net of fewest edits and a proof; None does not.
        seed: of every random choice.
        budget_s: end of the search; None searches a fixed amount of work.
        mesh_edit_mm: how far the surface may be changed if there is no net; None leaves it as it is.
        leave_out: whether faces may be left out if there is no net.
    """

    method: str = "nb"
    base: int | None = None
    prove_s: float | None = None
    seed: int = 0
    budget_s: float | None = None
    mesh_edit_mm: float | None = None
    leave_out: bool = False


@dataclass(frozen=True)
class PlanOptions:
    """How the folds are planned.

    Attributes:
        planner: name of the planner.
        tilt_deg: largest tilt of the rotary; None takes the rig's.
        seed: of every random choice.
        budget_s: end of the search; None searches a fixed amount of work.
        without: rules that are switched off.
        keep_net: fold the net as it is, try no other.
        fixed_base: keep the base face of the net.
        bend_allowance: move the faces in the flat for the radius of the bends.
        relief: holes where creases meet: ``auto``, ``off`` or their radius in mm.
        certify: prove every turn free of contact.
        diagnosis: look into why creases stay short, and what would free them.
        prefer: what settings of the laser are chosen for: ``joules`` or ``seconds``.
        start_c: highest mean temperature of a crease when a pass begins, °C; None takes the usual one.
        take_turns: fold another, cold crease while one cools, where that saves time.
        heating: where angles of passes come from: ``fast``, the closed form, or ``section``.
    """

    planner: str = "fp"
    tilt_deg: float | None = None
    seed: int = 0
    budget_s: float | None = None
    without: tuple[str, ...] = ()
    keep_net: bool = False
    fixed_base: bool = False
    bend_allowance: bool = True
    relief: str = "auto"
    certify: bool = False
    diagnosis: bool = True
    prefer: str = "joules"
    start_c: float | None = None
    take_turns: bool = False
    heating: str = "fast"


def parameters(options: MeshOptions | NetOptions | PlanOptions) -> dict[str, Any]:
    """Options as JSON values for the manifest; of paths only the name counts."""
    values = asdict(options)
    out: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, Path):
            out[name] = value.name
        elif isinstance(value, tuple):
            out[name] = list(value)
        else:
            out[name] = value
    return out


def option_text(value: object) -> str:
    """A value that somebody chose, or that was taken, as short text; a hyphen where there is none."""
    if value is None or value == "":
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value)) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value)
