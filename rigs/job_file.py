"""``job.json``: the blocks of a job in columns, with their lines in ``job.gcode``."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path

from planner.atomic_file import write_atomic
from rigs.errors import JobError
from rigs.gcode import gcode_program
from rigs.job import Block, GcodeStyle, Job, MachinePoint

__all__ = ["read_job", "write_job"]

FORMAT = "metal-blossom/job"
VERSION = 1

COLUMNS = (
    "kind", "step", "crease", "path", "end", "rotary_deg", "power_w", "s", "mm_s", "wait_s", "beam_s",
    "seconds", "first_line", "last_line", "text",
)  # fmt: skip
"""One row per block. ``path`` lists the points of the lit path; a block starts where the one before ended."""

LARGEST_FILE = 200_000_000


def write_job(job: Job, path: Path) -> None:
    """Write ``job.json``; the file is whole or not there.

    Raises:
        JobError: if the job cannot be written as G-code.
        OSError: if the file cannot be written.
    """
    program = gcode_program(job)
    rows = []
    for block, lines in zip(job.blocks, program.blocks[1:-1], strict=True):
        rows.append(
            [
                block.kind, block.step, block.crease, block.path, block.end,
                round(math.degrees(block.rotary_rad), 3),
                block.power_w, block.s_word, block.speed_mm_s, block.wait_s, block.beam_s, block.seconds,
                lines.first_line, lines.last_line, block.text,
            ]
        )  # fmt: skip
    head = {
        "format": FORMAT,
        "version": VERSION,
        "rig": job.rig_name,
        **{f"{name}_sha256": value for name, value in sorted(job.hashes.items())},
        "job_sha256": job.sha256,
        "gcode_sha256": hashlib.sha256(program.text.encode("ascii")).hexdigest(),
        "totals": {
            "blocks": len(job.blocks),
            "strokes": job.strokes,
            "seconds": round(job.seconds, 3),
            "beam_s": round(job.beam_s, 3),
            "energy_j": round(job.energy_j, 3),
        },
        "notices": list(job.notices),
        "pattern": job.pattern,
        "style": {
            "rotary_word": job.style.rotary_word,
            "rotary_units_per_rad": job.style.rotary_units_per_rad,
            "has_focus_axis": job.style.has_focus_axis,
            "line_chars": job.style.line_chars,
            "block_bytes": job.style.block_bytes,
        },
        "start": job.blocks[0].start if job.blocks else (0.0, 0.0, 0.0),
        "columns": list(COLUMNS),
    }
    try:
        text = json.dumps(head, indent=1, allow_nan=False)
        body = ",\n".join(json.dumps(row, separators=(",", ":"), allow_nan=False) for row in rows)
    except ValueError as error:
        raise JobError(f"the job holds a figure that is not finite: make it anew ({error})") from error
    write_atomic(path, f'{text[:-2]},\n "rows": [\n{body}\n]}}\n')


def read_job(path: Path, gcode: Path | None = None) -> Job:
    """Read ``job.json``; the blocks come back exactly as they were written.

    Args:
        path: the file.
        gcode: ``job.gcode``; its bytes must be those that the blocks give.

    Raises:
        JobError: if a file cannot be read, does not follow the format, or the files do not belong together.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise JobError(f"{path}: larger than {LARGEST_FILE // 1_000_000} MB: this is not a job")
        data = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise JobError(f"{path}: cannot read the job: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise JobError(f"{path}: not JSON: {error}") from error
    try:
        job, stated = _job(data, path)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, JobError):
            raise
        raise JobError(
            f"{path}: does not follow the format of job.json: {error!r}: make the job anew"
        ) from error
    if job.sha256 != stated["job"]:
        raise JobError(f"{path}: the blocks do not have the hash that the file states: make the job anew")
    if gcode is not None:
        try:
            sent = gcode.read_bytes()
        except OSError as error:
            raise JobError(f"{gcode}: cannot read the G-code: {error.strerror or error}") from error
        made = gcode_program(job).text.encode("ascii")
        if sent != made or hashlib.sha256(sent).hexdigest() != stated["gcode"]:
            raise JobError(
                f"{gcode}: is not the G-code of {path.name}: one of them was changed, make both anew"
            )
    return job


def _job(data: object, path: Path) -> tuple[Job, dict[str, str]]:
    if not isinstance(data, dict) or data.get("format") != FORMAT or data.get("version") != VERSION:
        raise JobError(f"{path}: expected format {FORMAT}, version {VERSION}")
    if data["columns"] != list(COLUMNS):
        raise JobError(f"{path}: columns are {data['columns']}, expected {list(COLUMNS)}")
    own = ("job_sha256", "gcode_sha256")
    hashes = {
        k.removesuffix("_sha256"): str(v) for k, v in data.items() if k.endswith("_sha256") and k not in own
    }
    place = _point(data["start"])
    blocks = []
    for number, row in enumerate(data["rows"]):
        values = dict(zip(COLUMNS, row, strict=True))
        if values["kind"] not in ("goto", "rotate", "pass", "cut", "wait", "ask"):
            raise JobError(f"{path}: block {number} has the unknown kind {values['kind']!r}")
        end = _point(values["end"])
        blocks.append(
            Block(
                kind=values["kind"],
                step=int(values["step"]),
                start=place,
                path=tuple(_point(p) for p in values["path"]),
                end=end,
                rotary_rad=float(values["rotary_deg"]) * math.pi / 180.0,
                crease=int(values["crease"]),
                power_w=float(values["power_w"]),
                s_word=float(values["s"]),
                speed_mm_s=float(values["mm_s"]),
                wait_s=float(values["wait_s"]),
                beam_s=float(values["beam_s"]),
                seconds=float(values["seconds"]),
                text=str(values["text"]),
            )
        )
        place = end
    job = Job(
        rig_name=str(data["rig"]),
        hashes=hashes,
        style=GcodeStyle(**data["style"]),
        blocks=tuple(blocks),
        notices=tuple(map(str, data["notices"])),
        pattern={str(k): float(v) for k, v in data.get("pattern", {}).items()},
    )
    return job, {"job": str(data["job_sha256"]), "gcode": str(data["gcode_sha256"])}


def _point(values: object) -> MachinePoint:
    if not (isinstance(values, list) and len(values) == 3):
        raise TypeError(f"expected three coordinates, got {values!r}")
    x, y, z = values
    return float(x), float(y), float(z)
