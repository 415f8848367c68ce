"""The command at the bottom of the report gives the same options again."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from studio.manifest import Manifest
from studio.options import MeshOptions, NetOptions, PlanOptions, parameters
from studio.report_command import command_lines


def manifest(mesh, net, plan=None, **rig):
    stages = {"mesh": parameters(mesh), "net": parameters(net)}
    if plan is not None:
        stages["plan"] = parameters(plan)
    return Manifest(
        input={"name": mesh.path.name}, parameters=stages, rig={"name": "grbl-4axis"} | rig,
        material={"name": "304", "thickness_mm": 0.1},
    )  # fmt: skip


def options_of(lines, monkeypatch, tmp_path):
    """What the commands would run with: mesh, net and plan options, as the pipeline gets them."""
    from studio import pipeline, stages
    from studio.cli import main

    monkeypatch.chdir(tmp_path)
    got = {}

    def made(_target, mesh, net, plan, machine, **_rest):
        got.update(mesh=mesh, net=net, plan=plan, machine=machine)
        raise KeyboardInterrupt

    def netted(_target, mesh, net, machine, **_rest):
        got.update(mesh=mesh, net=net, machine=machine)
        raise KeyboardInterrupt

    def ran(_target, _stage, work, _progress):
        class Ws:
            manifest = Manifest(seed=got["net"].seed, parameters={"net": parameters(got["net"])})

        work(Ws())
        raise KeyboardInterrupt

    monkeypatch.setattr(pipeline, "make", made)
    monkeypatch.setattr(pipeline, "make_net_bundle", netted)
    monkeypatch.setattr(pipeline, "run_stage", ran)
    monkeypatch.setattr(stages, "plan_stage", lambda _ws, options: got.update(plan=options))
    for line in lines:
        assert main(shlex.split(line)[1:]) == 130
    return got


MESH, NET = MeshOptions(Path("my bunny.obj")), NetOptions()


@pytest.mark.parametrize(
    ("mesh", "net", "plan", "commands"),
    [
        (MESH, NET, None, 1),
        (MESH, NET, PlanOptions(), 1),
        (replace(MESH, size_mm=60.5, faces=150), replace(NET, seed=7, budget_s=12.0, base=3, leave_out=True),
         PlanOptions(seed=7, budget_s=12.0, fixed_base=True, tilt_deg=20.0, without=("sight", "held"),
                     bend_allowance=False, relief="0.3", certify=True, diagnosis=False, prefer="seconds",
                     start_c=150.0, take_turns=True, heating="section"), 1),
        (replace(MESH, scale=25.4), replace(NET, method="steepest", seed=2),
         PlanOptions(seed=2, keep_net=True), 2),
        (MESH, replace(NET, prove_s=60.0, mesh_edit_mm=0.2), PlanOptions(seed=4, planner="mp"), 2),
    ],
)  # fmt: skip
def test_the_command_gives_the_same_options_again(mesh, net, plan, commands, monkeypatch, tmp_path):
    lines = command_lines(manifest(mesh, net, plan))
    assert len(lines) == commands
    got = options_of(lines, monkeypatch, tmp_path)
    assert got["mesh"] == mesh
    assert got["net"] == net
    if plan is not None:
        assert got["plan"] == plan
    assert (got["machine"].rig, got["machine"].material, got["machine"].thickness_mm) == (
        "grbl-4axis",
        "304",
        0.1,
    )


def test_a_profile_of_the_users_own_is_named_by_its_copy():
    (line,) = command_lines(manifest(MESH, NET, PlanOptions(), name="my laser"))
    assert "--rig rig.toml" in line
