"""How long the first and the later starts take: help, imports, and the jitted kernels cold and warm.

``python benchmarks/start_up.py [MESH]`` prints seconds, best of several runs, each in a process of its own.
Cold means an empty kernel cache in a folder of its own; the cache of the installation is left alone.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from models.goals import goal_path

PACKAGES = ("planner", "rigs", "twin", "studio.cli")


def seconds(command: Sequence[str], runs: int, environment: dict[str, str] | None = None) -> float:
    """Shortest time of ``runs`` runs of a command that has to succeed."""
    best = float("inf")
    for _ in range(runs):
        start = time.perf_counter()
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        best = min(best, time.perf_counter() - start)
        if done.returncode not in (0, 1):
            raise SystemExit(f"{' '.join(command)} ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return best


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("mesh", type=Path, nargs="?", default=goal_path("star"))
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args(arguments)
    blossom = str(Path(sys.executable).parent / "blossom")
    rows = [("an empty Python", seconds([sys.executable, "-c", ""], options.runs))]
    rows += [(f"import {p}", seconds([sys.executable, "-c", f"import {p}"], options.runs)) for p in PACKAGES]
    rows.append(("blossom --help", seconds([blossom, "--help"], options.runs)))
    with tempfile.TemporaryDirectory() as folder:
        cached = {**os.environ, "NUMBA_CACHE_DIR": str(Path(folder) / "kernels")}
        command = [blossom, "make", str(options.mesh), "-o", str(Path(folder) / "bundle"), "--force"]
        cold = seconds(command, 1, cached)
        warm = seconds(command, options.runs, cached)
    rows += [
        ("make, kernels not yet compiled", cold),
        ("make, kernels cached", warm),
        ("first-run cost", cold - warm),
    ]
    for name, value in rows:
        print(f"{name:32} {value:8.2f} s")


if __name__ == "__main__":
    main()
