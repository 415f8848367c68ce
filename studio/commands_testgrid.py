"""``blossom testgrid``: the job that burns a strip to calibrate on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from studio.errors import UsageError
from studio.exit_codes import DONE
from studio.flags import Force, Json, MachineFlags, Quiet, positive
from studio.progress import Progress
from studio.summary import print_summary

__all__ = ["testgrid"]

MOST_PIECES = 2000


def testgrid(
    *,
    kind: Annotated[
        Literal["fold", "kerf"],
        Parameter(metavar="fold|kerf", help="Fingers that are folded, or windows that are cut out."),
    ] = "fold",
    powers: Annotated[
        str | None, Parameter(metavar="W,W,...", help="Laser powers to try [by the model].")
    ] = None,
    speeds: Annotated[str | None, Parameter(metavar="MM/S,...", help="Speeds to try [by the model].")] = None,
    passes: Annotated[
        str | None,
        Parameter(metavar="N,N,...", help="Numbers of passes to try [folds 1,5,10,20, cuts 1]."),
    ] = None,
    repeats: Annotated[
        int, Parameter(metavar="N", validator=positive, help="How often each setting is burnt.")
    ] = 1,
    width: Annotated[
        float, Parameter(metavar="MM", validator=positive, help="Of a finger, its crease, or a window.")
    ] = 8.0,
    length: Annotated[
        float, Parameter(metavar="MM", validator=positive, help="Of a finger, or height of a window.")
    ] = 8.0,
    machine: MachineFlags = MachineFlags(),  # noqa: B008  frozen
    output: Annotated[
        Path, Parameter(metavar="DIR", name=["-o", "--output"], help="Folder of the strip.")
    ] = Path("strip"),
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Make the job of a test strip: power x speed x passes, each on a finger of its own.

    Writes a folder with G-code, a picture with the number of every piece, and strip.csv to fill in.
    blossom replay burns it, blossom calibrate reads the table.

    Examples:
        blossom testgrid --material 304 --thickness 0.1 --repeats 3 -o strip

        blossom replay strip --port emulator --arm

        blossom testgrid --kind kerf --speeds 20,30,40,60 -o kerf
    """  # fmt: skip
    from studio.bundle import create_bundle
    from studio.manifest import Manifest
    from studio.strip_stage import StripOptions, keep_filled_table, strip_stage
    from studio.strip_summary import strip_summary
    from studio.workspace import Workspace

    counts = figures("--passes", passes)
    if any(n != round(n) or n > MOST_PIECES for n in counts):
        raise UsageError(f"--passes {passes}: expected whole numbers from 1 to {MOST_PIECES}")
    options = StripOptions(
        kind, figures("--powers", powers), figures("--speeds", speeds), tuple(round(n) for n in counts),
        repeats, width, length,
    )  # fmt: skip
    if repeats > MOST_PIECES:
        raise UsageError(f"--repeats {repeats}: expected 1 to {MOST_PIECES}")
    if force:
        keep_filled_table(output)
    with create_bundle(output, force=force) as folder:
        ws = Workspace(folder, Manifest(), Progress(quiet=quiet or json))
        strip_stage(ws, machine.options(), options)
        summary = strip_summary(ws)
        ws.finish()
    print_summary(summary.with_bundle(str(output)), as_json=json)
    return DONE


def figures(flag: str, text: str | None) -> tuple[float, ...]:
    """Figures above 0 from a list with commas, each once.

    Raises:
        UsageError: if one is none.
    """
    if text is None:
        return ()
    values = []
    for word in text.split(","):
        try:
            value = float(word)
        except ValueError:
            value = float("nan")
        if not 0.0 < value < 1e6:
            raise UsageError(f"{flag} {text}: expected figures above 0 with commas between, such as 6,8,10")
        values.append(value)
    return tuple(dict.fromkeys(values))
