"""Runs ``blossom make`` over many meshes and writes what came out as CSV and Markdown.

``python benchmarks/corpus.py --meshes ../shared/meshes/real ../shared/meshes/proc -o out/corpus``

Every mesh is made in a process of its own with a time limit. The figures are read from the files of the
bundle, so they do not rest on what the command says about itself. ``--checker FILE`` runs
``python FILE BUNDLE`` on each bundle that was called pass: it exits with 0, or prints what it found as JSON.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import queue
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

TIMEOUT_EXIT = -1


@dataclass(frozen=True)
class Outcome:
    """One line of the table; figures are None where no bundle was written."""

    mesh: str
    kind: str
    faces: int
    exit_code: int
    verdict: str
    edits: int | None
    completion: float | None
    shape_rms_mm: float | None
    blocked: int | None
    steps: int | None
    seconds: float
    checker: str
    reason: str


def mesh_kind(path: Path) -> tuple[str, int]:
    """("closed" or "open", number of triangles) of an OBJ file of triangles."""
    count: Counter[tuple[int, int]] = Counter()
    faces = 0
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        if line.startswith("f "):
            corners = [int(word.split("/")[0]) for word in line.split()[1:]]
            faces += len(corners) - 2
            for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
                count[min(a, b), max(a, b)] += 1
    return ("open" if 1 in count.values() else "closed"), faces


def run_limited(
    command: Sequence[str], limit_s: float, processors: frozenset[int] = frozenset()
) -> tuple[int, str, str]:
    """Exit code, stdout and stderr; with TIMEOUT_EXIT when the process and its children had to be ended.

    ``processors``: those that it may use; empty: all.
    """
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    if processors:
        os.sched_setaffinity(process.pid, processors)  # its threads and children are confined as well
    try:
        out, err = process.communicate(timeout=limit_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        out, err = process.communicate()
        return TIMEOUT_EXIT, out, err
    return process.returncode, out, err


def read_json(path: Path) -> dict[str, Any]:
    """A JSON object, or an empty one where the file is not there."""
    loaded: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    return loaded


def reason_of(out: str, err: str) -> str:
    """What the command said about a run that did not pass, on one line."""
    try:
        summary = json.loads(out)
    except ValueError:
        summary = {}
    for key in ("reason", "message", "error"):
        value = summary.get(key)
        if isinstance(value, dict):
            value = value.get("message")
        if value:
            return " ".join(str(value).split())[:300]
    lines = [line.strip() for line in err.splitlines() if line.strip()]
    return lines[-1][:300] if lines else ""


def run_checker(checker: Path, bundle: Path, limit_s: float) -> str:
    """What an independent checker says of a bundle: ok, or what it found."""
    code, out, err = run_limited([sys.executable, str(checker), str(bundle)], limit_s)
    if code == 0:
        return "ok"
    try:
        kinds = json.loads(out.strip().splitlines()[-1])["failed_kinds"]
        return ", ".join(f"{name} x{number}" for name, number in kinds.items())
    except (ValueError, KeyError, IndexError, AttributeError):
        return f"exit {code}: {' '.join((out + err).split())[-200:]}"


def processor_sets(each: int, jobs: int) -> list[frozenset[int]]:
    """One set of processors for each job, of ``each`` that no other job has; empty sets where that is 0.

    Raises:
        ValueError: if there are not enough.
    """
    if each == 0:
        return [frozenset()] * jobs
    usable = sorted(os.sched_getaffinity(0))
    if each * jobs > len(usable):
        raise ValueError(
            f"{jobs} jobs of {each} processors each need {each * jobs}; {len(usable)} are usable"
        )
    return [frozenset(usable[k * each : (k + 1) * each]) for k in range(jobs)]


def run_mesh(
    path: Path, folder: Path, options: argparse.Namespace, processors: frozenset[int] = frozenset()
) -> Outcome:
    """Make one mesh and collect the figures."""
    kind, faces = mesh_kind(path)
    bundle = folder / path.stem
    command = [options.command, "make", str(path), "-o", str(bundle), "--json", *options.make_option]
    start = time.monotonic()
    code, out, err = run_limited(command, options.limit, processors)
    seconds = time.monotonic() - start
    plan, net = read_json(bundle / "plan.json"), read_json(bundle / "net.fold")
    verdict = str(read_json(bundle / "validation.json").get("verdict", ""))
    metrics = plan.get("metrics", {})
    checker = ""
    if options.checker and verdict == "pass":
        checker = run_checker(options.checker, bundle, options.limit * 5)
    timed_out = f"over the limit of {options.limit:g} s" if code == TIMEOUT_EXIT else ""
    outcome = Outcome(
        mesh=path.stem,
        kind=kind,
        faces=faces,
        exit_code=code,
        verdict=verdict,
        edits=net.get("blossom:certificate", {}).get("edits"),
        completion=metrics.get("fold_completion"),
        shape_rms_mm=metrics.get("shape_rms"),
        blocked=len(plan["blocked"]) if "blocked" in plan else None,
        steps=len(plan["steps"]) if "steps" in plan else None,
        seconds=round(seconds, 2),
        checker=checker,
        reason=timed_out or ("" if code == 0 else reason_of(out, err)),
    )
    if not options.keep:
        shutil.rmtree(bundle, ignore_errors=True)
    print(
        f"{outcome.mesh:24} {faces:5d} faces  exit {code:2d}  {verdict:10} "
        f"{'-' if outcome.completion is None else format(outcome.completion, '.3f'):>6}  {seconds:6.1f} s  "
        f"{checker}  {outcome.reason[:80]}",
        flush=True,
    )
    return outcome


def shape_line(group: Sequence[Outcome]) -> str:
    """Mean completion, and how many meshes come out as wanted: 99.9 % folded, 0.5 mm from the goal."""
    planned = [o for o in group if o.completion is not None]
    if not planned:
        return "no plan"
    mean = 100 * sum(o.completion or 0.0 for o in planned) / len(planned)
    whole = sum((o.completion or 0.0) >= 0.999 and (o.shape_rms_mm or 0.0) <= 0.5 for o in planned)
    return (
        f"mean completion {mean:.2f} % of {len(planned)} plans; 99.9 % folded and at most 0.5 mm off: "
        f"{whole} of {len(group)} ({100 * whole / len(group):.1f} %)"
    )


def summary_lines(outcomes: Sequence[Outcome], limit_s: float) -> list[str]:
    """What the table comes to: shares of folded meshes, exit codes, times and what the checker found."""
    lines = []
    for kind in ("closed", "open"):
        group = [o for o in outcomes if o.kind == kind]
        if group:
            good = sum(o.completion is not None and o.completion >= 0.95 and o.exit_code == 0 for o in group)
            share = 100 * good / len(group)
            lines.append(f"{kind}: {good} of {len(group)} fold to at least 95 % ({share:.1f} %)")
            lines.append(f"{kind}: {shape_line(group)}")
    codes = Counter(o.exit_code for o in outcomes)
    words = {0: "exit 0 (pass)", 1: "exit 1 (no)", TIMEOUT_EXIT: f"over {limit_s:g} s"}
    lines.append(", ".join(f"{words.get(code, f'exit {code}')}: {n}" for code, n in sorted(codes.items())))
    silent = [o.mesh for o in outcomes if o.exit_code != 0 and not o.reason]
    lines.append(f"ended without a reason: {', '.join(silent) or 'none'}")
    if outcomes:
        seconds = sorted(o.seconds for o in outcomes)
        lines.append(f"seconds: median {seconds[len(seconds) // 2]:.1f}, longest {seconds[-1]:.1f}")
    checked = [o for o in outcomes if o.checker]
    if checked:
        wrong = [f"{o.mesh} ({o.checker})" for o in checked if o.checker != "ok"]
        lines.append(f"checker: {len(checked) - len(wrong)} of {len(checked)} bundles without a finding")
        lines += [f"checker finds: {text}" for text in wrong]
    return lines


def write_tables(outcomes: Sequence[Outcome], lines: Sequence[str], folder: Path) -> None:
    """Write corpus.csv and corpus.md."""
    names = [field.name for field in fields(Outcome)]
    with (folder / "corpus.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(asdict(outcome) for outcome in outcomes)
    rows = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    for outcome in outcomes:
        values = asdict(outcome).values()
        cells = ["" if v is None else f"{v:.4f}" if isinstance(v, float) else str(v) for v in values]
        rows.append("| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |")
    text = "# Corpus\n\n" + "".join(f"- {line}\n" for line in lines) + "\n" + "\n".join(rows) + "\n"
    (folder / "corpus.md").write_text(text, encoding="utf-8")


def options_from(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Parse the command line."""
    shared = Path(__file__).resolve().parent.parent.parent / "shared" / "meshes"
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    add = parser.add_argument
    add("--meshes", type=Path, nargs="+", default=[shared / "real", shared / "proc"], metavar="DIR")
    add("--only", nargs="*", default=[], metavar="NAME", help="only these meshes")
    add("--max-faces", type=int, default=150, metavar="N")
    add("--limit", type=float, default=60.0, metavar="SECONDS", help="for each mesh")
    add("--checker", type=Path, default=None, metavar="FILE")
    add("--command", default=str(Path(sys.executable).parent / "blossom"))
    add("--make-option", action="append", default=[], metavar="OPTION", help="--make-option=--seed=3")
    add("--keep", action="store_true", help="keep the bundles")
    add("-j", "--jobs", type=int, default=2)
    add("--processors", type=int, default=0, metavar="N", help="confine each run to N of its own (Linux)")
    add("--kind", choices=("closed", "open"), default=None, help="only closed or only open meshes")
    add("-o", "--output", type=Path, default=Path("out/corpus"))
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; 0 unless there was nothing to run."""
    options = options_from(arguments)
    paths = sorted(path for folder in options.meshes for path in folder.glob("*.obj") if path.is_file())
    paths = [p for p in paths if not options.only or p.stem in options.only]
    kinds = {p: mesh_kind(p) for p in paths}
    paths = [p for p in paths if kinds[p][1] <= options.max_faces and options.kind in (None, kinds[p][0])]
    if not paths:
        print(
            f"no mesh of at most {options.max_faces} faces in {', '.join(map(str, options.meshes))}",
            file=sys.stderr,
        )
        return 2
    try:
        sets = processor_sets(options.processors, options.jobs)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    options.output.mkdir(parents=True, exist_ok=True)
    bundles = options.output / "bundles"
    if not options.keep:
        bundles = Path(tempfile.mkdtemp(prefix="blossom-corpus-"))
    elif bundles.exists():
        shutil.rmtree(bundles)
    bundles.mkdir(exist_ok=True)
    free: queue.SimpleQueue[frozenset[int]] = queue.SimpleQueue()
    for processors in sets:
        free.put(processors)

    def run(path: Path) -> Outcome:
        processors = free.get()
        try:
            return run_mesh(path, bundles, options, processors)
        finally:
            free.put(processors)

    with ThreadPoolExecutor(options.jobs) as pool:
        outcomes = list(pool.map(run, paths))
    if not options.keep:
        shutil.rmtree(bundles, ignore_errors=True)
    lines = summary_lines(outcomes, options.limit)
    write_tables(outcomes, lines, options.output)
    print("\n".join(["", *lines, f"tables: {options.output}/corpus.csv, corpus.md"]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
