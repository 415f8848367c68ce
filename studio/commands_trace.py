"""``blossom trace``: compare what was lit."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from studio.commands_lists import say
from studio.errors import UsageError
from studio.exit_codes import DONE, NO
from studio.flags import Json

if TYPE_CHECKING:
    from rigs.job import Job
    from rigs.machine_trace import MachineTrace
    from rigs.rig import Rig

__all__ = ["trace"]


def trace(
    what: Annotated[Literal["compare"], Parameter(help="compare: whether two runs lit the same.")],
    wanted: Annotated[
        Path, Parameter(help="Folder of a bundle (its job), a trace of the emulated machine, or a journal.")
    ],
    got: Annotated[Path, Parameter(help="The same; what is compared with it.")],
    /,
    *,
    bundle: Annotated[
        Path | None,
        Parameter(metavar="DIR", help="Bundle whose rig and job both belong to [the one of the two]."),
    ] = None,
    json: Json = False,
) -> int:
    """Compare what two runs lit: order, places, rotary, dose of each crease, and light where none should be.

    Places may differ by a step or 0.01 mm, the rotary by 0.1 degrees, the dose by 2 %. Exit code 1 means
    that they
    differ.

    Examples:
        blossom trace compare out/bunny trace.jsonl

        blossom trace compare out/bunny out/bunny/journal-001.jsonl
    """
    from rigs.job_file import read_job
    from rigs.machine_trace import compare_traces
    from rigs.rig import load_rig
    from studio.workspace import RIG_FILE

    assert what == "compare"  # noqa: S101  the only one yet
    home = bundle or next((p for p in (wanted, got) if p.is_dir()), None)
    home = home or next((p.parent for p in (wanted, got) if (p.parent / "job.json").is_file()), None)
    if home is None or not (home / "job.json").is_file():
        raise UsageError("which rig? Name the bundle with --bundle DIR; it needs a job (blossom job DIR)")
    rig, job = load_rig(home / RIG_FILE), read_job(home / "job.json", home / "job.gcode")
    a, b = _trace(wanted, rig, job), _trace(got, rig, job)
    differences = compare_traces(a, b, rig, job)
    if json:
        values = {
            "format": "metal-blossom/trace-compare", "version": 1, "wanted": a.name, "got": b.name,
            "strokes": [len(a.strokes), len(b.strokes)], "same": not differences,
            "differences": list(differences),
        }  # fmt: skip
        say(json_text.dumps(values, ensure_ascii=False))
        return NO if differences else DONE
    for difference in differences:
        say(difference)
    unit = "blocks" if a.ends_only or b.ends_only else "strokes"
    say(
        f"{b.name} differs from {a.name}"
        if differences
        else f"{b.name} is {a.name}: {len(b.strokes)} {unit} in the same order, places and dose"
    )
    return NO if differences else DONE


def _trace(path: Path, rig: Rig, job: Job) -> MachineTrace:
    from rigs.machine_trace import trace_of_file, trace_of_job, trace_of_journal

    if path.is_dir():
        return trace_of_job(job, path.name)
    if not path.is_file():
        raise UsageError(f"{path}: no such file or bundle")
    with path.open("rb") as file:
        start = file.read(200)
    if b'"kind":"header"' in start:
        return trace_of_journal(path, job, rig)
    return trace_of_file(path, rig)
