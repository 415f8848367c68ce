"""``blossom bench paper``: many cases, several processes, rows written as they come, tables at the end."""

from __future__ import annotations

import csv
import functools
import json
import multiprocessing
import signal
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import TextIO

from studio.bench_cases import MESH_SUFFIXES, BenchSettings, Case, Row, run_case
from studio.bench_tables import markdown
from studio.errors import OutputError, UsageError
from studio.progress import Progress

__all__ = ["find_meshes", "paper_cases", "read_rows", "run_bench"]

ROWS_FILE, TABLE_FILE = "paper.csv", "paper.md"
_NUMBERS = ("faces", "seed", "clipped_faces", "rotations")
_DECIMALS = ("completion", "shape_rms_mm", "clipped_area_mm2", "seconds")


def find_meshes(folders: Sequence[Path]) -> list[Path]:
    """The mesh files in folders (and single files), by name.

    Raises:
        UsageError: if a path is not there, or there is no mesh.
    """
    found: list[Path] = []
    for place in folders:
        if place.is_file():
            found.append(place)
        elif place.is_dir():
            found += sorted(p for p in place.iterdir() if p.suffix.lower() in MESH_SUFFIXES and p.is_file())
        else:
            raise UsageError(f"--meshes {place}: no such file or folder")
    if not found:
        raise UsageError(
            f"--meshes: no mesh in {', '.join(map(str, folders))}; expected files that end in "
            f"{', '.join(MESH_SUFFIXES)}"
        )
    return found


def paper_cases(meshes: Iterable[Path], nets: Sequence[str], seeds: int) -> list[Case]:
    """Every net of every mesh; seed after seed, so that a run that is stopped has seen all meshes."""
    return [Case(mesh, net, seed) for seed in range(seeds) for mesh in meshes for net in nets]


def run_bench(
    cases: Sequence[Case],
    settings: BenchSettings,
    folder: Path,
    *,
    command: str,
    jobs: int = 1,
    resume: bool = False,
    progress: Progress,
) -> list[Row]:
    """Run ``cases``; writes ``paper.csv`` while it goes, and tables and pictures at the end or at Ctrl-C.

    Args:
        cases: what to run.
        settings: how.
        folder: where the files go.
        command: how it was started, for the head of the table.
        jobs: processes.
        resume: keep the rows that ``folder`` has and run what is missing.
        progress: where to tell how far it is.

    Raises:
        OutputError: if rows are there already and are neither to be kept nor to be replaced.
        KeyboardInterrupt: after the tables are written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / ROWS_FILE
    rows: list[Row] = []
    if target.exists():
        if not resume:
            raise OutputError(f"{target} is there already; --resume goes on with it, or give another -o")
        rows = read_rows(target)
    seen = {(row.mesh, row.net, row.seed) for row in rows}
    left = [case for case in cases if (case.mesh.stem, case.net, case.seed) not in seen]
    with target.open("w", newline="", encoding="utf-8") as file:
        _writer(file).writeheader()
        _writer(file).writerows(asdict(row) for row in rows)
        file.flush()
        try:
            with progress.stage("bench", f"{len(left)} nets"), _results(left, settings, jobs) as results:
                for number, more in enumerate(results, 1):
                    _writer(file).writerows(asdict(row) for row in more)
                    file.flush()
                    rows += more
                    if more:
                        progress.update(number / len(left), f"{more[0].mesh} {more[0].net}")
        finally:
            write_tables(rows, settings, folder, command)
    return rows


def write_tables(rows: Sequence[Row], settings: BenchSettings, folder: Path, command: str) -> None:
    """``paper.md`` and the pictures."""
    from studio.bench_pictures import pictures

    ordered = sorted(rows, key=lambda row: (row.mesh, row.seed, row.net, row.planner, row.variant))
    (folder / TABLE_FILE).write_text(markdown(ordered, settings, command), encoding="utf-8")
    for name, text in pictures(ordered).items():
        (folder / name).write_text(text, encoding="utf-8")


def read_rows(path: Path) -> list[Row]:
    """The rows of a ``paper.csv``; a case at the end that was cut off while it was written is left out.

    Raises:
        UsageError: if the file has other columns.
    """
    names = [field.name for field in fields(Row)]
    with path.open(newline="", encoding="utf-8") as file:
        text = file.read()
    reader = csv.DictReader(text.splitlines(keepends=True))
    if reader.fieldnames != names:
        raise UsageError(f"{path} has other columns than this version writes; give another -o")
    lines = list(reader)
    if not text.endswith("\n") and lines:  # the last line is not whole, and nor is its case
        last = [lines[-1][name] for name in ("mesh", "net", "seed")]
        before = [lines[-2][name] for name in ("mesh", "net", "seed")] if len(lines) > 1 else last
        lines = [
            line
            for line in lines[:-1]
            if [line[name] for name in ("mesh", "net", "seed")] not in (last, before)
        ]
    out = []
    for values in lines:
        converted: dict[str, object] = dict(values)
        for name in _NUMBERS:
            converted[name] = int(values[name]) if values[name] else None
        for name in _DECIMALS:
            converted[name] = float(values[name]) if values[name] else None
        out.append(Row(**converted))  # type: ignore[arg-type]  # the columns are the fields
    return out


def _writer(file: TextIO) -> csv.DictWriter[str]:
    return csv.DictWriter(file, [field.name for field in fields(Row)])


@contextmanager
def _results(cases: Sequence[Case], settings: BenchSettings, jobs: int) -> Iterator[Iterator[list[Row]]]:
    """The rows of each case, as they come; processes are ended when the caller stops."""
    work = functools.partial(run_case, settings=settings)
    if jobs <= 1 or len(cases) <= 1:
        yield map(work, cases)
        return
    # spawned, so that no worker inherits threads or half a compiled kernel
    with multiprocessing.get_context("spawn").Pool(min(jobs, len(cases)), _ignore_ctrl_c) as pool:
        yield pool.imap_unordered(work, cases)


def _ignore_ctrl_c() -> None:
    """Ctrl-C is for the process that waits; it ends the others."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def headline_json(rows: Sequence[Row]) -> str:
    """The means as one JSON object."""
    from studio.bench_tables import headline

    document = {"format": "metal-blossom/bench-paper", "version": 1, "headline": headline(rows)}
    return json.dumps(document, ensure_ascii=False)
