"""The process of a plan: passes that end at the plan's angles, within the limits of the rig."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.fold_plan import Cut, Fold, Release, Rotate
from rigs.limits import machine_limits
from rigs.material import load_material
from rigs.rig import load_rig
from tests.rigs.made_jobs import centred, made_plan
from tests.twin.hand_plans import breadth_first_net, icosahedron, outside_in_steps, plan_of
from twin.errors import HeatingError
from twin.heating import bend
from twin.plan_process import ALLOWED_START_C, plan_process
from twin.process_table import (
    DESIGN_FOURIER,
    DESIGN_PEAK_SHARE,
    WARM_PEAK_SHARE,
    Conditions,
    SettingTable,
)

RIG, STEEL = load_rig("grbl-4axis"), load_material("304")
FOIL = Conditions(STEEL, 0.1, 0.35, 0.05, 0.05, 19.0, 200.0, ALLOWED_START_C, 0.1)


@pytest.fixture(scope="module")
def table() -> SettingTable:
    return SettingTable(FOIL)


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0, 40.0])
@pytest.mark.parametrize("goal", ["star", "box", "ball"])
def test_every_fold_ends_at_the_plan(goal, tilt_deg):
    plan = made_plan(goal, tilt_deg=tilt_deg)
    process = plan_process(plan, RIG, STEEL)
    folds = [(n, s) for n, s in enumerate(plan.steps) if isinstance(s, Fold)]
    assert [f.step for f in process.folds] == [n for n, _ in folds]
    rotary = 0.0
    for number, step in enumerate(plan.steps):
        if isinstance(step, Rotate):
            rotary = step.to_rad
        if not isinstance(step, Fold):
            continue
        fold = process.fold_at[number]
        assert fold.predicted_rad == pytest.approx(step.to_rad, abs=1e-6)
        assert sum(fold.increments_rad) == pytest.approx(step.to_rad - fold.from_rad, abs=1e-6)
        assert all(i * (step.to_rad - fold.from_rad) > 0 for i in fold.increments_rad)
        assert 0.3 < math.degrees(abs(fold.increments_rad[0])) < 1.5
        assert len(fold.waits_s) == fold.passes
        assert min(fold.waits_s[:-1], default=0.1) >= 0.1
        assert fold.power_w <= RIG.laser.cap_fraction * RIG.laser.max_w
        assert fold.speed_mm_s <= 200.0
        assert fold.peak_top_c <= DESIGN_PEAK_SHARE * STEEL.constants.solidus_c
        assert fold.fourier <= DESIGN_FOURIER
        assert fold.regime in ("tgm", "mixed")
        assert math.degrees(fold.tilt_rad) == pytest.approx(tilt_deg, abs=1e-9)
        assert math.cos(rotary) * (step.to_rad - fold.from_rad) > 0
        assert fold.energy_j == pytest.approx(fold.passes * fold.power_w * fold.length_mm / fold.speed_mm_s)
    assert process.energy_j == pytest.approx(
        sum(f.energy_j for f in process.folds) + sum(c.energy_j for c in process.cuts)
    )
    assert process.passes == sum(f.passes for f in process.folds) > 0
    assert process.plan_wait_s == 3.0
    assert process.calibration == "none"
    assert any("not calibrated" in flag for flag in process.flags)


def test_a_fold_in_two_steps_goes_on_where_it_stopped():
    plan = made_plan("star")
    steps = list(plan.steps)
    at = next(i for i, s in enumerate(steps) if isinstance(s, Fold))
    fold = steps[at]
    half = replace(plan, steps=(*steps[:at], Fold(fold.crease, 0.5 * fold.to_rad), *steps[at:]))
    whole, parts = plan_process(plan, RIG, STEEL), plan_process(half, RIG, STEEL)
    first, second = parts.fold_at[at], parts.fold_at[at + 1]
    assert second.from_rad == first.to_rad
    assert second.predicted_rad == pytest.approx(fold.to_rad)
    # The metal has hardened: the second half takes more passes than the first.
    assert first.passes < second.passes
    assert parts.passes_of_crease[fold.crease] == first.passes + second.passes
    assert first.passes + second.passes == pytest.approx(whole.fold_at[at].passes, rel=0.25)


def test_the_same_plan_gives_the_same_process():
    plan = made_plan("ball", tilt_deg=20.0)
    assert plan_process(plan, RIG, STEEL).sha256 == plan_process(plan, RIG, STEEL).sha256
    assert plan_process(plan, RIG, STEEL).sha256 != plan_process(plan, RIG, load_material("316")).sha256


def test_cuts_melt_the_kerf():
    plan = made_plan("star")
    process = plan_process(plan, RIG, STEEL)
    for number, step in enumerate(plan.steps):
        if isinstance(step, (Cut, Release)):
            cut = process.cut_at[number]
            length = sum(math.dist(a, b) for path in step.paths for a, b in itertools.pairwise(path))
            assert cut.length_mm == pytest.approx(length)
            assert cut.energy_j == pytest.approx(cut.power_w * cut.passes * length / cut.speed_mm_s)
            asked = bend(STEEL, 0.1, cut.power_w, cut.speed_mm_s / cut.passes, spot_mm=0.1, absorptivity=0.35)
            assert asked.regime == "cuts"
    assert {c.step for c in process.cuts} == {
        n for n, s in enumerate(plan.steps) if isinstance(s, (Cut, Release))
    }


def test_thicker_metal_is_cut_slower_and_folded_in_more_passes():
    thin = made_plan("star")
    thick = replace(thin, limits=machine_limits(RIG, STEEL, 0.15))
    a, b = plan_process(thin, RIG, STEEL), plan_process(thick, RIG, STEEL)
    assert b.cuts[0].speed_mm_s < a.cuts[0].speed_mm_s
    assert b.energy_j > a.energy_j


def test_a_crease_that_turns_away_from_the_beam_is_refused():
    plan = made_plan("star")
    wrong = replace(plan, steps=tuple(s for s in plan.steps if not isinstance(s, Rotate)))
    with pytest.raises(HeatingError, match="away from the beam"):
        plan_process(wrong, RIG, STEEL)
    study = plan_process(replace(wrong, without=("side",)), RIG, STEEL)
    assert any("turns the other way" in flag for flag in study.flags)


def test_a_sheet_on_edge_is_refused():
    plan = made_plan("star")
    edge = tuple(Rotate(math.pi / 2) if isinstance(s, Rotate) else s for s in plan.steps)
    with pytest.raises(HeatingError, match="on edge"):
        plan_process(replace(plan, steps=edge), RIG, STEEL)


def test_a_plan_of_another_net_is_refused():
    plan = made_plan("star")
    boundary = int(np.flatnonzero(plan.net.assignment == "B")[0])
    with pytest.raises(HeatingError, match=f"net edge {boundary}"):
        plan_process(replace(plan, steps=(Fold(boundary, 0.5),)), RIG, STEEL)


def test_metal_that_the_rig_cannot_fold_is_refused_with_the_reason():
    with pytest.raises(HeatingError, match=r"no setting folds 6061 t6 .*choose another rig"):
        plan_process(made_plan("star"), RIG, load_material("6061"))


def test_less_light_is_absorbed_under_co2():
    """A rig of 10.6 µm sees bare steel as a mirror: the process says so or refuses."""
    plan = made_plan("star")
    dim = plan_process(plan, RIG, STEEL, absorptivity=0.2)
    assert dim.energy_j > plan_process(plan, RIG, STEEL).energy_j
    with pytest.raises(HeatingError):
        plan_process(plan, RIG, STEEL, absorptivity=1.2)


@given(st.floats(0.5, 150.0), st.integers(0, 60), st.floats(0.0, 0.5))
@settings(max_examples=60)
def test_a_schedule_ends_at_the_angle_with_the_fewest_passes(table, degrees, done, stroke_s):
    angle = math.radians(degrees)
    chain = table.best(angle, 20.0)
    schedule = chain.schedule(angle, stroke_s, done)
    increments = np.array(schedule.increments_rad)
    assert np.all(np.diff(increments) <= 1e-12)
    assert increments.max() <= chain.first_rad * (1 + 1e-9)
    assert len(schedule.waits_s) == len(increments)
    assert schedule.power_w <= chain.power_w
    if not schedule.short:
        assert increments.sum() == pytest.approx(angle, abs=1e-9)
        hardening = (1 + (done + np.arange(len(increments) - 1)) / chain.half_passes) ** -1.0
        assert (
            chain.first_rad * 0.92 * hardening[:-1].sum() < angle or len(increments) == 1
        )  # one pass less would not do
    else:
        assert abs(increments.sum() - angle) <= chain.first_rad


@given(st.floats(1.0, 80.0))
@settings(max_examples=20)
def test_more_angle_never_takes_less(table, degrees):
    small = table.best(math.radians(degrees), 20.0).schedule(math.radians(degrees), 0.2)
    chain = table.best(math.radians(degrees), 20.0)
    large = chain.schedule(math.radians(1.1 * degrees), 0.2)
    assert len(large.increments_rad) >= len(small.increments_rad)
    assert sum(large.waits_s) >= sum(small.waits_s) - 1e-9


@pytest.mark.parametrize("degrees", [15.0, 60.0, 110.0])
def test_no_other_setting_needs_much_less_energy(table, degrees):
    """Against every usable setting, pass by pass without the small effect of start temperature."""
    angle = math.radians(degrees)
    joules = []
    for index in table._usable.tolist():
        row = table.table.at(index)
        sums = np.cumsum(float(row.angle_rad) / (1.0 + np.arange(2000) / float(row.half_passes)))
        if sums[-1] >= angle:
            count = int(np.searchsorted(sums, angle)) + 1
            joules.append(count * float(row.power_w) / float(row.speed_mm_s))
    chain = table.best(angle, 20.0)
    schedule = chain.schedule(angle, 0.2)
    assert len(joules) > 15
    assert len(schedule.increments_rad) * chain.power_w / chain.speed_mm_s <= 1.15 * min(joules)


def test_the_objective_counts(table):
    def seconds(objective) -> float:
        chain = table.best(math.radians(60.0), 20.0, objective)
        schedule = chain.schedule(math.radians(60.0), 20.0 / chain.speed_mm_s)
        return len(schedule.increments_rad) * 20.0 / chain.speed_mm_s + sum(schedule.waits_s)

    assert seconds("seconds") <= 1.02 * seconds("joules")


def test_no_angle_takes_no_pass(table):
    schedule = table.best(0.0, 20.0).schedule(0.0, 0.1)
    assert schedule.increments_rad == schedule.waits_s == ()


def test_an_angle_out_of_reach_is_refused():
    hard = Conditions(STEEL, 0.2, 0.35, 0.05, 0.05, 19.0, 200.0, ALLOWED_START_C, 0.1)
    table = SettingTable(hard)
    with pytest.raises(HeatingError, match="3000 passes"):
        table.best(math.radians(150), 20.0).schedule(math.radians(150), 0.1)


def test_a_plan_of_ten_thousand_passes():
    net = centred(breadth_first_net(icosahedron(20.0, 1)))
    folds = [
        Fold(s.crease, math.copysign(math.radians(75.0), s.to_rad)) if isinstance(s, Fold) else s
        for s in outside_in_steps(net)
    ]
    process = plan_process(plan_of(net, folds, limits=machine_limits(RIG, STEEL)), RIG, STEEL)
    assert process.passes > 10_000
    assert len(process.folds) == 79


@pytest.mark.parametrize("metal", ["304", "1100", "6061", "titanium-2"])
@pytest.mark.parametrize("allowed", [60.0, 150.0, 280.0])
def test_a_warm_start_leaves_room_below_melting(metal, allowed):
    where = replace(
        FOIL, material=load_material(metal), allowed_c=allowed, largest_mm_s=2000.0, largest_w=90.0
    )
    solidus = where.material.constants.solidus_c
    try:
        chain = SettingTable(where).best(math.radians(40.0), 20.0)
    except HeatingError:
        return
    assert chain.peak_top_c <= DESIGN_PEAK_SHARE * solidus
    assert chain.peak_top_c + allowed - 20.0 <= WARM_PEAK_SHARE * solidus
    assert chain.power_w > 0.0
