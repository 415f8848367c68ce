"""The hinge of older MuJoCo versions against the one of 4.0, on the version that is installed."""

from __future__ import annotations

import numpy as np
import pytest

from planner.goal_mesh import GoalMesh
from tests.twin.hand_plans import box, breadth_first_net, icosahedron, plan_of, star
from tests.twin.test_dynamics import BLIND, SOFT
from twin.dynamics import DynamicResult, dynamic_run
from twin.hinge_drive import Drive, best_drive
from twin.hinge_law import STEEL_304, SheetMetal
from twin.loaded_model import LoadedModel
from twin.mjcf_model import compile_model
from twin.run_settings import RunSettings
from twin.sweep import kinematic_sweep

ANGLE_BOUND_DEG = 1e-3
"""By so much the end angles of the two drives may differ where no hinge yields."""


def both(goal: GoalMesh, settings: RunSettings, metal: SheetMetal = STEEL_304) -> list[DynamicResult]:
    plan = plan_of(breadth_first_net(goal))
    drives: tuple[Drive, ...] = ("springyield", "actuator")
    models = [compile_model(plan, metal, drive=drive) for drive in drives]
    sweep = kinematic_sweep(models[0], plan)
    return [dynamic_run(model, plan, sweep, settings=settings) for model in models]


@pytest.mark.parametrize("goal", [box(), star(), icosahedron(), icosahedron(30, 1)])
def test_both_drives_end_at_the_same_angles_under_gravity(goal: GoalMesh) -> None:
    spring, actuator = both(goal, BLIND)
    assert spring.finished and actuator.finished
    assert np.degrees(np.abs(spring.angles_rad - actuator.angles_rad).max()) < ANGLE_BOUND_DEG
    assert np.degrees(np.abs(spring.permanent_rad - actuator.permanent_rad).max()) < ANGLE_BOUND_DEG
    assert actuator.largest_sag_rad == pytest.approx(spring.largest_sag_rad, rel=0.01, abs=1e-7)
    assert {(e.kind, e.step, e.pair) for e in actuator.events} == {
        (e.kind, e.step, e.pair) for e in spring.events
    }


@pytest.mark.parametrize("goal", [box(), star(), icosahedron()])
def test_without_gravity_the_actuator_ends_where_the_plan_says(goal: GoalMesh) -> None:
    plan = plan_of(breadth_first_net(goal))
    compiled = compile_model(plan, drive="actuator")
    result = dynamic_run(compiled, plan, kinematic_sweep(compiled, plan), settings=RunSettings(gravity=False))
    assert result.finished
    assert np.degrees(np.abs(result.angles_rad - plan.final_angles).max()) < 1e-3


def test_both_drives_sag_alike_where_the_sheet_is_soft() -> None:
    spring, actuator = both(box(20, 20, 20), BLIND, SOFT)
    assert spring.largest_sag_rad > np.radians(0.05)
    assert np.degrees(np.abs(spring.angles_rad - actuator.angles_rad).max()) < 0.01


def test_an_overloaded_hinge_bends_for_good_with_either_drive() -> None:
    weak = SheetMetal(198.5e9, 0.29, 3e6, 7900.0)
    spring, actuator = both(icosahedron(), BLIND, weak)
    plan = plan_of(breadth_first_net(icosahedron()))
    bent = [np.abs(r.permanent_rad - plan.final_angles).max() for r in (spring, actuator)]
    assert min(bent) > np.radians(0.02)
    assert bent[1] == pytest.approx(bent[0], rel=0.25)  # the creep is one step behind MuJoCo's own
    assert spring.yield_share == pytest.approx(1.0, abs=1e-6)
    assert actuator.yield_share == pytest.approx(1.0, abs=1e-6)


def test_models_hold_what_their_drive_needs() -> None:
    plan = plan_of(breadth_first_net(star()))
    spring, actuator = (compile_model(plan, drive=d) for d in ("springyield", "actuator"))
    assert best_drive() == "springyield" and compile_model(plan).xml == spring.xml
    assert "springyield" not in actuator.xml and "<actuator>" not in spring.xml
    model = actuator.load()
    assert model.nu == model.njnt == spring.load().njnt
    loaded = [LoadedModel(c, plan.net) for c in (spring, actuator)]
    assert loaded[0].stiffness == pytest.approx(loaded[1].stiffness, rel=1e-12)
    for one in loaded:
        one.rest.set(one.rest.names[2], 0.25)
        one.rest.add(one.rest.names[2], 0.5)
        assert one.rest.of(one.rest.names[2]) == 0.75
        assert one.rest.all().tolist() == [0.0, 0.0, 0.75, *[0.0] * (model.njnt - 3)]
        assert one.rest.elastic()[2] == -0.75
        assert one.rest.extremes(1.0) == (0.75, True)
