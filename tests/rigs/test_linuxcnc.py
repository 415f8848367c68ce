"""LinuxCNC's interpreter, which nobody here wrote, reads our G-code as the path that the plan has."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from models.goals import goal_names, goal_path
from planner import make_net, plan_folds, read_goal
from rigs.gcode import write_gcode
from rigs.job_build import make_job
from rigs.limits import machine_limits
from rigs.machine_trace import compare_traces, trace_of_job
from rigs.material import load_material
from rigs.replay_blocks import replay_job
from rigs.replay_checks import check_job
from rigs.rig import load_rig
from tests.rigs.fault_runs import fault_job
from tests.rigs.linuxcnc import INTERPRETER, MISSING, read_with_linuxcnc
from tests.rigs.made_jobs import made
from twin.plan_process import plan_process

pytestmark = pytest.mark.skipif(INTERPRETER is None, reason=MISSING)

CASES = [("star", "grbl-4axis", 0.0), ("box", "grbl-4axis", 20.0), ("star", "galvo-like", 0.0)]


@pytest.mark.parametrize(("goal", "name", "tilt"), CASES)
def test_path_power_and_angles(tmp_path, goal, name, tilt):
    _, _, rig, job = made(goal, name, tilt_deg=tilt)
    check_job(replay_job(job), rig)
    path = tmp_path / "job.ngc"
    path.write_text(write_gcode(job))
    read = read_with_linuxcnc(path, rig)
    assert compare_traces(trace_of_job(job), read.trace, rig) == ()
    turned = [b.rotary_rad for b in job.blocks if b.kind == "rotate"]
    moves = sum(not math.isclose(a, b, abs_tol=1e-9) for a, b in zip([0.0, *turned], turned, strict=False))
    assert read.dark_turns == moves
    assert "PROGRAM_END" in read.calls[-3:]
    assert read.pauses == 0


def test_the_file_for_other_senders_stops_before_each_turn(tmp_path):
    _, _, rig, job = made("box", "grbl-4axis")
    path = tmp_path / "job.ngc"
    path.write_text(write_gcode(job, pauses=True))
    read = read_with_linuxcnc(path, rig)
    assert compare_traces(trace_of_job(job), read.trace, rig) == ()
    assert read.pauses == sum(b.kind in ("rotate", "ask") for b in job.blocks)


def test_it_finds_a_wrong_byte(tmp_path):
    """The comparison is no rubber stamp: another coordinate, power or angle is told."""
    _, _, rig, job = made("star", "grbl-4axis")
    text = write_gcode(job)
    lit = next(line for line in text.splitlines() if "S" in line and line.startswith("X"))
    turn = [line for line in text.splitlines() if line.startswith("G0A")][1]
    for old, new in ((lit, lit.replace("X", "X1", 1)), (lit, lit[: lit.index("S")] + "S7"), (turn, "G0A33")):
        path = tmp_path / "job.ngc"
        path.write_text(text.replace(f"\n{old}\n", f"\n{new}\n"))
        assert compare_traces(trace_of_job(job), read_with_linuxcnc(path, rig).trace, rig) != ()


def test_a_rotary_on_the_plug_of_z(tmp_path):
    """There the z word turns the sheet: no height is ever written."""
    rig = load_rig("grbl-diode-swap")
    job = fault_job(rig)
    path = tmp_path / "job.ngc"
    path.write_text(write_gcode(job))
    read = read_with_linuxcnc(path, rig)
    assert compare_traces(trace_of_job(job), read.trace, rig) == ()
    assert read.dark_turns == 2


@pytest.mark.slow
@pytest.mark.parametrize("goal", goal_names())
def test_every_shipped_goal(tmp_path, goal):
    """The whole way from a mesh: what the plan lights is what LinuxCNC reads."""
    whole_way(goal_path(goal), tmp_path, None)


@pytest.mark.slow
def test_the_bunny(tmp_path, shared_meshes):
    whole_way(shared_meshes / "real" / "bunny-128.obj", tmp_path, 60.0)


def whole_way(mesh: Path, folder: Path, size_mm: float | None) -> None:
    rig, material = load_rig("grbl-4axis"), load_material("304")
    limits = machine_limits(rig, material)
    plan = plan_folds(make_net(read_goal(mesh, size_mm=size_mm, limits=limits), seed=0), limits, seed=0)
    job = make_job(plan, plan_process(plan, rig, material), rig, material)
    path = folder / "job.ngc"
    path.write_text(write_gcode(job))
    read = read_with_linuxcnc(path, rig)
    assert compare_traces(trace_of_job(job), read.trace, rig) == ()
    assert len(read.trace.strokes) == len(trace_of_job(job).strokes) > 0
