"""Flags that commands share: names, help texts and checks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from studio.options import DEFAULT_MATERIAL, DEFAULT_RIG, MachineOptions, MeshOptions

__all__ = [
    "Base", "Budget", "Bundle", "Certify", "CureFlags", "Encoder", "Force", "HeatFlags", "Json",
    "MachineFlags", "Mesh", "MeshFlags", "NoDiagnosis", "Output", "Port", "Quiet", "Rule", "Seed", "Shadow",
    "Tilt", "Verbose", "View", "Without", "Yes",
]  # fmt: skip

Rule = Literal["outside-in", "side", "sight", "contact", "substrate", "held", "clearance"]
"""Rules that ``--without`` may switch off; the planner has the same list."""


def positive(_kind: Any, value: float | None) -> None:  # noqa: ANN401  any annotated type
    """Refuse what is not a finite number above zero."""
    if value is not None and not (math.isfinite(value) and value > 0.0):
        raise ValueError("must be a finite number above 0.")


def not_negative(_kind: Any, value: float | None) -> None:  # noqa: ANN401  any annotated type
    """Refuse what is not a finite number from zero on."""
    if value is not None and not (math.isfinite(value) and value >= 0.0):
        raise ValueError("must be a finite number, 0 or more.")


def finite(_kind: Any, value: float | None) -> None:  # noqa: ANN401  any annotated type
    """Refuse what is not a finite number."""
    if value is not None and not math.isfinite(value):
        raise ValueError("must be a finite number.")


Mesh = Annotated[Path, Parameter(help="Triangle mesh: STL, OBJ, PLY, OFF, glTF or GLB.")]
Bundle = Annotated[Path, Parameter(help="Folder of the bundle.")]
Output = Annotated[
    Path | None,
    Parameter(metavar="DIR", name=["-o", "--output"], help="Folder of the bundle [named after the mesh]."),
]
Seed = Annotated[int, Parameter(metavar="N", validator=not_negative, help="Seed of every random choice.")]
Budget = Annotated[
    float | None,
    Parameter(
        metavar="SECONDS",
        validator=positive,
        help="Stop the searches after so many seconds with what they have.",
    ),
]
Base = Annotated[
    int | None,
    Parameter(metavar="FACE", validator=not_negative, help="Face that stays on the sheet [chosen]."),
]
Tilt = Annotated[
    float | None,
    Parameter(
        metavar="DEG",
        validator=not_negative,
        help="Let the rotary tilt the sheet by so many degrees [of the rig].",
    ),
]
Without = Annotated[
    list[Rule],
    Parameter(
        metavar="RULE",
        consume_multiple=True,
        show_default=False,
        help="Switch rules off for a study; the output says so.",
    ),
]
Certify = Annotated[
    bool,
    Parameter(
        show_default=False,
        help="Prove every turn free of contact; writes contact.json.",
    ),
]
NoDiagnosis = Annotated[
    bool,
    Parameter(show_default=False, help="Do not look into why creases stay short, and what would free them."),
]
Json = Annotated[bool, Parameter(name="--json", show_default=False, help="Print one JSON object.")]
Quiet = Annotated[bool, Parameter(name=["-q", "--quiet"], show_default=False, help="No progress.")]
Verbose = Annotated[
    bool,
    Parameter(
        name=["-v", "--verbose"],
        show_default=False,
        help="Also say which files are written; progress every second.",
    ),
]
Port = Annotated[str, Parameter(metavar="URL", help="emulator, /dev/ttyUSB0, COM3 or socket://HOST:PORT.")]
Yes = Annotated[
    bool, Parameter(show_default=False, help="Confirm beforehand that a person stands by a real laser.")
]
Shadow = Annotated[
    bool, Parameter(show_default=False, help="The twin follows, and stops the machine where it differs.")
]
Encoder = Annotated[
    str | None,
    Parameter(metavar="URL", help="Port of an encoder on the rotary; every turn is checked by it."),
]
View = Annotated[
    bool, Parameter(show_default=False, help="Show machine and twin side by side in a browser (extra: view).")
]
Force = Annotated[bool, Parameter(show_default=False, help="Replace the bundle that is in the folder.")]


@Parameter(name="*")
@dataclass(frozen=True)
class MeshFlags:
    """How the mesh is read."""

    size: Annotated[
        float | None,
        Parameter(metavar="MM", validator=positive, help="Scale so that the longest side is so many mm."),
    ] = None
    scale: Annotated[
        float | None,
        Parameter(metavar="X", validator=positive, help="Scale by a factor, such as 25.4 for inches."),
    ] = None
    faces: Annotated[
        int | None, Parameter(metavar="N", validator=positive, help="Coarsen to at most so many faces.")
    ] = None

    def options(self, path: Path) -> MeshOptions:
        """The same as plain options."""
        return MeshOptions(path, self.size, self.scale, self.faces)


@Parameter(name="*")
@dataclass(frozen=True)
class BendFlags:
    """How bends are allowed for in the flat sheet."""

    bend_allowance: Annotated[
        Literal["on", "off"],
        Parameter(
            metavar="on|off",
            help="Move the faces in the flat so that bends of a radius give the goal's size.",
        ),
    ] = "on"
    relief: Annotated[
        str,
        Parameter(metavar="auto|off|MM", help="Holes where creases meet: usual, none, or their radius."),
    ] = "auto"


@Parameter(name="*")
@dataclass(frozen=True)
class HeatFlags:
    """How creases are heated and cool."""

    prefer: Annotated[
        Literal["joules", "seconds"],
        Parameter(metavar="joules|seconds", help="What power and speed of the folds are chosen for."),
    ] = "joules"
    start_temperature: Annotated[
        float | None,
        Parameter(
            metavar="C",
            validator=positive,
            help="A pass begins when the crease is at so many °C or colder [200].",
        ),
    ] = None
    take_turns: Annotated[
        bool,
        Parameter(
            show_default=False,
            help="Fold another, cold crease while one cools, where that saves time.",
        ),
    ] = False
    heating: Annotated[
        Literal["fast", "section"],
        Parameter(
            metavar="fast|section",
            help="Angles of passes: closed form, or tables of the layered section (a second per setting).",
        ),
    ] = "fast"


@Parameter(name="*")
@dataclass(frozen=True)
class CureFlags:
    """What may be done to a mesh that has no net."""

    mesh_edit: Annotated[
        float | None,
        Parameter(
            metavar="MM",
            validator=positive,
            help="If there is no net, change the mesh: the surface may deviate by so many mm.",
        ),
    ] = None
    leave_out: Annotated[
        bool,
        Parameter(show_default=False, help="If there is no net, leave faces out; the output names them."),
    ] = False


@Parameter(name="*")
@dataclass(frozen=True)
class MachineFlags:
    """Machine and sheet."""

    rig: Annotated[
        str, Parameter(metavar="NAME|FILE", help="Machine: a name (see blossom rigs) or a profile file.")
    ] = DEFAULT_RIG
    material: Annotated[
        str,
        Parameter(metavar="NAME|FILE", help="Sheet metal: a name (see blossom materials) or a profile file."),
    ] = DEFAULT_MATERIAL
    thickness: Annotated[
        float | None,
        Parameter(metavar="MM", validator=positive, help="Thickness of the sheet in mm [of the rig]."),
    ] = None

    def options(self) -> MachineOptions:
        """The same as plain options."""
        return MachineOptions(self.rig, self.material, self.thickness)
