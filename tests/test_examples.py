"""Every example runs as it stands, in a folder of its own, and prints what it promises."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"

PROMISED = {
    "00_first_part": ("verdict: pass", "report.html", "complete"),
    "01_read_a_mesh": ("turned 1 of 4 faces", "volume 4500 mm³", "more than two faces"),
    "02_compare_nets": ("nb          0 overlapping", "net: base face", "not formable"),
    "03_prove_fewest_edits": (
        "none has fewer: True",
        "the proof holds: True",
        "forged: the proof holds: False",
    ),
    "04_plan_the_folds": ("folded 100.0%", "flips only: folded"),
    "05_bend_one_crease": ("tgm", "mixed", "melts", "not for folding"),
    "06_process_and_gcode": ("passes of", "blocks", "the first light: M4S0 | G1"),
    "07_validate_in_mujoco": ("verdict: pass", "uncalibrated", "too far: contact", "meet at"),
    "08_replay_emulated": ("complete", "emulated: True", "stopped:", "in doubt:"),
    "09_scatter": ("as planned:", "touched up:", "in common"),
}


def test_every_example_is_run_here():
    assert sorted(file.stem for file in EXAMPLES.glob("*.py")) == sorted(PROMISED)


@pytest.mark.parametrize("name", sorted(PROMISED))
def test_example(name, tmp_path):
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / f"{name}.py")],
        cwd=tmp_path, capture_output=True, text=True, timeout=900,
        env={**os.environ, "MUJOCO_GL": os.environ.get("MUJOCO_GL", "egl")},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    for words in PROMISED[name]:
        assert words in done.stdout
    assert {path.name for path in tmp_path.iterdir()} <= {"out"}
