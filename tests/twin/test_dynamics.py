"""The dynamic run: exact without gravity, honest with it, the same every time."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from planner.fold_plan import Fold, Rotate
from planner.goal_mesh import GoalMesh
from rigs.process import FoldProcess, Process
from tests.twin.hand_plans import box, breadth_first_net, icosahedron, outside_in_steps, plan_of, star
from twin.dynamics import dynamic_run
from twin.errors import ModelError
from twin.heating_interface import EqualPasses, ProcessHeating
from twin.hinge_law import STEEL_304, SheetMetal
from twin.loaded_model import LoadedModel
from twin.mjcf_model import compile_model
from twin.run_settings import RunSettings
from twin.sweep import kinematic_sweep
from twin.timeline import turns
from twin.touches import elastic_press

BLIND = RunSettings(sight_every_rad=100.0)


def run(plan, settings=None, heating=None, metal=STEEL_304):
    compiled = compile_model(plan, metal)
    return dynamic_run(compiled, plan, kinematic_sweep(compiled, plan), heating, settings)


@pytest.mark.parametrize("goal", [box(), star(), icosahedron(), icosahedron(30, 1)])
def test_without_gravity_every_crease_ends_where_the_plan_says(goal: GoalMesh) -> None:
    plan = plan_of(breadth_first_net(goal))
    result = run(plan, RunSettings(gravity=False))
    assert result.finished
    assert np.degrees(np.abs(result.angles_rad - plan.final_angles).max()) < 0.001
    assert np.degrees(np.abs(result.permanent_rad - plan.final_angles).max()) < 1e-6
    assert [e for e in result.events if e.kind != "occluded"] == []
    assert result.warnings == ()


def test_sag_is_that_of_a_beam_on_a_spring() -> None:
    """One flap: moment of its weight over the stiffness of its hinge, wherever the part is turned to."""
    flap = np.array([[0, 0, 0], [20, 0, 0], [0, 30, 0], [20, -40, 1.0]])
    net = breadth_first_net(GoalMesh(flap, np.array([[0, 1, 2], [1, 0, 3]])))
    crease = int(net.crease_of[1])
    soft = SheetMetal(2e9, 0.3, 265e6, 7900.0)
    for rotary in (0.0, np.pi):
        plan = plan_of(net, [Rotate(rotary), Fold(crease, 1e-3 if rotary == 0.0 else -1e-3)])
        result = run(plan, BLIND, metal=soft)
        corners = net.vertices[net.faces[1]]
        start, end = net.hinge(1)
        u = (end - start) / np.linalg.norm(end - start)
        a, b = corners[1] - corners[0], corners[2] - corners[0]
        area = 0.5 * abs(a[0] * b[1] - a[1] * b[0])
        arm = abs((corners.mean(axis=0) - start) @ np.array([-u[1], u[0]]))
        moment = 7900e-6 * 0.1 * area * 9810.0 * arm
        stiffness = 2e9 * 0.1**3 / (12 * (1 - 0.09)) * 20.0
        assert result.largest_sag_rad == pytest.approx(moment / stiffness, rel=0.02)
        reach = np.linalg.norm(corners.mean(axis=0) - net.vertices[net.faces[0]].mean(axis=0))
        assert result.tab_moment_n_m == pytest.approx(moment / arm * reach / 1e9, rel=0.02)
        sign = -1.0 if rotary == 0.0 else 1.0  # it hangs down, whichever side is up
        assert np.sign(result.angles_rad[crease] - plan.final_angles[crease]) == sign


def test_run_is_the_same_every_time() -> None:
    plan = plan_of(breadth_first_net(icosahedron()))
    first, second = run(plan), run(plan)
    assert first.state_sha256 == second.state_sha256
    assert first.events == second.events
    assert np.array_equal(first.angles_rad, second.angles_rad)


def test_passes_do_not_change_where_it_ends() -> None:
    plan = plan_of(breadth_first_net(star()))
    coarse = run(plan, BLIND, EqualPasses(np.radians(30.0)))
    fine = run(plan, BLIND, EqualPasses(np.radians(0.2)))
    assert coarse.angles_rad == pytest.approx(fine.angles_rad, abs=np.radians(1e-3))


def over_folded(goal: GoalMesh, factor: float):
    net = breadth_first_net(goal)
    folds = [s for s in outside_in_steps(net) if isinstance(s, Fold)]
    return plan_of(net, [Fold(f.crease, f.to_rad * factor) for f in folds])


def test_a_run_stops_at_the_first_hit_and_feels_it() -> None:
    plan = over_folded(box(20, 20, 20), 1.3)
    compiled = compile_model(plan)
    sweep = kinematic_sweep(compiled, plan)
    result = dynamic_run(compiled, plan, sweep, settings=BLIND)
    first = sweep.events[0]
    assert not result.finished
    assert result.missed == ()
    later = [s.crease for s in plan.steps[first.step + 1 :] if isinstance(s, Fold)]
    assert all(result.permanent_rad[c] == 0.0 for c in later)
    assert abs(result.angles_rad[first.crease]) < abs(first.angle_rad) + np.radians(4.0)


def test_sight_is_seen_to_be_blocked() -> None:
    """A box: the flap on a side's far end comes over the side's own crease once the side stands up."""
    result = run(plan_of(breadth_first_net(box())))
    blocked = [e for e in result.events if e.kind == "occluded"]
    assert {e.crease for e in blocked} == {0, 3}
    for event in blocked:
        assert event.faces
        assert "hidden from the beam by face" in event.detail
        assert abs(np.degrees(event.angle_rad)) > 10.0
    assert [e for e in run(plan_of(breadth_first_net(star()))).events if e.kind == "occluded"] == []


def test_a_run_out_of_bounds_is_a_failed_run_not_an_exception() -> None:
    plan = plan_of(breadth_first_net(star()))
    result = run(plan, RunSettings(largest_rate_rad_s=1e-3))
    assert not result.finished
    assert [e.kind for e in result.events] == ["numerical"]
    assert "rad/s" in result.events[0].detail


def process_of(plan, factor: float = 1.0) -> Process:
    folds = tuple(
        FoldProcess(
            step=t.step, crease=t.crease, from_rad=t.from_rad, to_rad=t.to_rad,
            predicted_rad=t.to_rad * factor,
            increments_rad=(factor * t.to_rad / 8,) * 8, waits_s=(0.5,) * 8, power_w=10.0, speed_mm_s=200.0,
            length_mm=10.0, tilt_rad=0.0, across_mm=0.05, fourier=0.3, peak_top_c=900.0, peak_bottom_c=300.0,
            regime="tgm", energy_j=4.0, beam_s=0.4, seconds=4.4,
        )
        for t in turns(plan, compile_model(plan).side)
    )  # fmt: skip
    return Process(folds, (), "test-model", "none", "C", "304", 0.35, 0.1)


def test_a_process_bends_by_its_own_increments() -> None:
    plan = plan_of(breadth_first_net(star()))
    result = run(plan, RunSettings(gravity=False), ProcessHeating(process_of(plan, 0.9)))
    assert result.angles_rad == pytest.approx(0.9 * plan.final_angles, abs=1e-5)


def test_a_process_of_another_plan_is_refused() -> None:
    plan = plan_of(breadth_first_net(star()))
    folds = [s for s in plan.steps if isinstance(s, Fold)]
    other = plan_of(
        plan.net, [s for f in reversed(folds) for s in (Rotate(0.0 if f.to_rad > 0 else np.pi), f)]
    )
    with pytest.raises(ModelError, match="made for another plan"):
        run(other, BLIND, ProcessHeating(process_of(plan_of(plan.net, [Rotate(0.0), folds[0], folds[1]]))))


def test_simulation_leaves_no_log_in_the_working_directory(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    plan = plan_of(breadth_first_net(star()))
    run(plan, RunSettings(largest_rate_rad_s=1e-3))
    assert list(tmp_path.iterdir()) == []
    assert mujoco.get_mju_user_warning() is None


SOFT = SheetMetal(2e9, 0.3, 265e6, 7900.0)


def test_sagging_faces_that_touch_are_noted_and_heavy_ones_are_sag() -> None:
    plan = plan_of(breadth_first_net(box(20, 20, 20)))
    light = run(plan, BLIND, metal=SOFT)
    assert light.events == ()
    assert light.noted
    assert all(t.kind == "sag" and t.depth_mm > 0.01 and t.force_n > 0.0 for t in light.noted)
    heavy = run(plan, replace(BLIND, heavy_yield_share=1e-9), metal=SOFT)
    assert {e.kind for e in heavy.events} == {"sag"}
    assert {e.pair for e in heavy.events} <= {t.pair for t in light.noted}
    assert heavy.finished
    # contacts are noticed only: what is noticed does not change where the part goes
    assert heavy.angles_rad == pytest.approx(light.angles_rad, abs=1e-6)


def test_press_of_one_hinge_is_depth_times_stiffness_over_arm_squared() -> None:
    net = breadth_first_net(star())
    loaded = LoadedModel(compile_model(plan_of(net)), net)
    face = int(np.flatnonzero(loaded.compiled.side.panel_of != 0)[0])
    joint = loaded.joint[f"crease_{net.crease_of[face]}"]
    stiffness = float(loaded.model.jnt_stiffness[joint].flat[0])
    along, up = loaded.data.xaxis[joint], np.array([0.0, 0.0, 1.0])
    where = loaded.data.xanchor[joint] + 3.0 * along + 7.0 * np.cross(along, up)
    force, share = elastic_press(loaded, (face,), where, 0.2)
    assert force * 1e6 == pytest.approx(0.2 * stiffness / 7.0**2, rel=1e-9)
    assert share == pytest.approx(0.2 / 7.0 / loaded.compiled.side.hinge.yield_rad, rel=1e-9)
    base = int(net.base_face)
    assert elastic_press(loaded, (face, base), where, 0.2)[0] == pytest.approx(force, rel=1e-12)
    assert elastic_press(loaded, (base,), where, 0.2) == (0.0, float("inf"))


def test_a_hinge_that_yields_under_the_load_is_noted_and_at_last_stalls() -> None:
    weak = SheetMetal(198.5e9, 0.29, 3e6, 7900.0)  # yields where steel of this thickness would only sag
    plan = plan_of(breadth_first_net(icosahedron()))
    result = run(plan, BLIND, metal=weak)
    assert result.yield_share == pytest.approx(1.0, abs=1e-6)
    assert any("yields under the load" in e.detail for e in result.noted)
    assert np.abs(result.permanent_rad - plan.final_angles).max() > np.radians(0.02)
