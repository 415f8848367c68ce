"""Runs CalculiX on the decks of one laser pass and reads how far the foil bent."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.calculix_deck import Pass, flange_places, foil_mesh, heat_deck, stress_deck
from rigs.material import Material

PROGRAM = "ccx"


class CalculixError(RuntimeError):
    """CalculiX did not come to an end."""


@dataclass(frozen=True, eq=False)
class Bent:
    """What the finite elements say.

    Attributes:
        angle_deg: fold angle, mean over the crease.
        entrance_deg: at its beginning.
        exit_deg: at its end.
        peak_top_c: hottest node of the lit face, in the middle half of the crease.
        peak_bottom_c: the same of the other face.
        dip_deg: lowest angle on the way.
        seconds: CPU time of CalculiX.
    """

    angle_deg: float
    entrance_deg: float
    exit_deg: float
    peak_top_c: float
    peak_bottom_c: float
    dip_deg: float
    seconds: float


def available() -> bool:
    """Whether the program is there."""
    return shutil.which(PROGRAM) is not None


def bent(case: Pass, material: Material, folder: Path, hardening_mpa: float, finer: float = 1.0) -> Bent:
    """Run heat and stresses of one pass.

    Raises:
        CalculixError: if a run did not come to an end.
    """
    mesh = foil_mesh(case, finer)
    began = os.times()
    _run(folder, "heat", heat_deck(case, mesh, material))
    count = len(mesh.points)
    fields = [block[:, 0] for block in _blocks(folder / "heat.dat", count)]
    if not fields:
        raise CalculixError(f"{folder}: no temperatures were written")
    _run(folder, "stress", stress_deck(mesh, material, fields, hardening_mpa))
    nx = len(mesh.x)
    near, far = flange_places(mesh)
    angles = []
    for block in _blocks(folder / "stress.dat", 2 * nx):
        lift = block[nx:, 2] - block[:nx, 2]
        angles.append(2.0 * np.degrees(np.arctan(lift / (mesh.y[far] - mesh.y[near]))))
    if len(angles) != len(fields) + 1:
        raise CalculixError(
            f"{folder}: {len(angles)} of {len(fields) + 1} steps were computed, see stress.log"
        )
    middle = np.abs(mesh.points[:, 0] - 0.5 * mesh.x[-1]) <= 0.25 * mesh.x[-1]
    hottest = np.where(middle, np.max(fields, axis=0), -np.inf)
    layer = nx * len(mesh.y)
    end = os.times()
    last = angles[-1]
    return Bent(
        float(last.mean()), float(last[0]), float(last[-1]), float(hottest[-layer:].max()),
        float(hottest[:layer].max()), min(float(a.mean()) for a in angles),
        end.children_user + end.children_system - began.children_user - began.children_system,
    )  # fmt: skip


def _run(folder: Path, name: str, deck: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.inp").write_text(deck, encoding="ascii")
    began = time.monotonic()
    with (folder / f"{name}.log").open("wb") as log:
        done = subprocess.run(
            [PROGRAM, "-i", name], cwd=folder, stdout=log, stderr=log, check=False,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )  # fmt: skip
    text = (folder / f"{name}.log").read_text("utf-8", "replace")
    if done.returncode != 0 or "*ERROR" in text:
        lines = [line.strip() for line in text.splitlines() if "*ERROR" in line]
        raise CalculixError(
            f"{folder / name}: CalculiX ended with {done.returncode} after {time.monotonic() - began:.0f} s: "
            f"{lines[0] if lines else 'see the log'}"
        )


def _blocks(path: Path, rows: int) -> Iterator[NDArray[np.float64]]:
    """Tables of a .dat file: (rows, columns) each, node numbers left out."""
    block: list[list[float]] = []
    with path.open(encoding="ascii") as lines:
        for line in lines:
            words = line.split()
            if not words or not words[0].isdigit():
                continue
            block.append([float(w) for w in words[1:]])
            if len(block) == rows:
                yield np.array(block)
                block = []
    if block:
        raise CalculixError(f"{path}: ends in the middle of a table")
