"""Start temperatures in the whole net: near to a fine field, never warmer than allowed."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tests.twin.thermal_plans import RIG, STEEL, shipped_plan
from twin.cooling import AMBIENT_C, crease_rise
from twin.errors import HeatingError
from twin.net_heat import NetHeat
from twin.plan_process import plan_process
from twin.thermal_field import ThermalField
from twin.thermal_mesh import net_mesh, plan_mesh

LINE_J_M = 17.5


def passes(net, count, interval, seed=0):
    """(crease, time) of passes in bursts on creases chosen at random."""
    rng = np.random.default_rng(seed)
    creases = [c for c, f in sorted(net.child_of.items()) if net.assignment[c] != "F"]
    chosen = np.repeat(rng.choice(creases, count // 10), 10)
    return [(int(c), interval * n) for n, c in enumerate(chosen)]


def fine_starts(field, net, burnt, step=0.01):
    """Start temperatures by brute force: small steps on a fine mesh."""
    lines = {c: field.line(*net.hinge(net.child_of[c])) for c, _ in burnt}
    lengths = {c: float(np.linalg.norm(np.subtract(*net.hinge(net.child_of[c])))) for c, _ in burnt}
    now, out = 0.0, []
    for crease, at in burnt:
        if at > now:
            field.advance(at - now, max(1, round((at - now) / step)))
            now = at
        out.append(field.mean_rise(lines[crease]))
        field.deposit(lines[crease], 1e-3 * LINE_J_M * lengths[crease])
    return np.array(out)


def quick_starts(heat, burnt):
    out = []
    for crease, at in burnt:
        out.append(heat.rise(crease, at))
        heat.burn(crease, LINE_J_M)
    return np.array(out)


@pytest.mark.parametrize(("name", "interval"), [("bracket", 0.4), ("crown", 0.4), ("flower", 0.8)])
def test_the_quick_heat_is_near_that_of_a_fine_field(name, interval):
    plan = shipped_plan(name)
    net = plan.net
    burnt = passes(net, 40, interval)
    fine = fine_starts(ThermalField(net_mesh(net, 1.0), STEEL, 0.1), net, burnt, step=0.02)
    quick = quick_starts(NetHeat(net, STEEL, 0.1), burnt)
    # it errs to the warm, safe side
    assert (quick - fine).max() <= 0.1 * fine.max()
    assert (quick - fine).min() >= -0.02 * fine.max()
    assert np.abs(quick - fine).mean() <= 0.05 * fine.max()


def test_a_crease_alone_tells_too_little_or_too_much():
    """Cuts keep heat together, and a short crease leads it away past its ends."""
    net = shipped_plan("flower").net
    ratio = []
    for crease in (0, 39):
        burnt = [(crease, 0.5 * n) for n in range(80)]
        ages = np.array([burnt[-1][1] - t for _, t in burnt[:-1]])
        quick = quick_starts(NetHeat(net, STEEL, 0.1), burnt)[-1]
        ratio.append(quick / float(crease_rise(ages, LINE_J_M, 0.1, STEEL).sum()))
    assert min(ratio) < 0.7
    assert max(ratio) > 1.2


def test_the_sheet_beyond_the_tabs_only_cools():
    plan = shipped_plan("crown")
    burnt = passes(plan.net, 60, 0.5)
    alone = quick_starts(NetHeat(plan.net, STEEL, 0.1), burnt)
    held = quick_starts(NetHeat(plan.net, STEEL, 0.1, mesh=plan_mesh(plan, 3.0)), burnt)
    assert (held <= alone + 1e-6).all()
    assert held == pytest.approx(alone, abs=0.05 * alone.max())


def test_a_copy_is_marched_on_its_own():
    plan = shipped_plan("bracket")
    crease = passes(plan.net, 10, 1.0)[0][0]
    heat = NetHeat(plan.net, STEEL, 0.1)
    heat.burn(crease, LINE_J_M)
    other = heat.copy()
    other.burn(crease, LINE_J_M)
    assert other.rise(crease, 2.0) == pytest.approx(2.0 * heat.rise(crease, 2.0))


def test_a_crease_is_waited_for_to_the_millisecond():
    plan = shipped_plan("bracket")
    crease = passes(plan.net, 10, 1.0)[0][0]
    waits = []
    for allowed in (40.0, 60.0, 100.0, 200.0):
        heat = NetHeat(plan.net, STEEL, 0.1)
        for _ in range(20):
            heat.burn(crease, LINE_J_M)
            heat.wait_until(heat.now_s + 0.2)
        before = heat.copy()
        at = heat.wait_until_cold(crease, allowed)
        assert heat.start_c(crease) <= allowed
        if at > before.now_s + 0.002:
            assert before.rise(crease, at - 0.002) > allowed - AMBIENT_C
        waits.append(at)
    assert waits == sorted(waits, reverse=True)
    assert len(set(waits)) > 2


def test_impossible_questions_are_refused():
    plan = shipped_plan("bracket")
    heat = NetHeat(plan.net, STEEL, 0.1)
    crease = next(iter(plan.net.child_of))
    heat.wait_until(3.0)
    with pytest.raises(HeatingError, match="has passed"):
        heat.wait_until(2.0)
    with pytest.raises(HeatingError, match="no crease of this net"):
        heat.rise(int(np.flatnonzero(plan.net.assignment == "B")[0]))
    heat.burn(crease, LINE_J_M)
    with pytest.raises(HeatingError, match="does not cool"):
        heat.wait_until_cold(crease, AMBIENT_C)


@pytest.mark.parametrize("name", ["bracket", "crown", "flower"])
def test_no_pass_begins_warmer_than_allowed(name):
    plan = shipped_plan(name)
    seconds = []
    for allowed in (120.0, 200.0):
        process = plan_process(plan, RIG, STEEL, allowed_start_c=allowed)
        assert process.heat == "net"
        assert process.peak_start_c <= process.allowed_start_c + 0.5 == allowed + 0.5
        for fold in process.folds:
            assert len(fold.start_c) == fold.passes
            assert fold.predicted_rad == pytest.approx(fold.to_rad, abs=1e-6) or fold.flags
        seconds.append(process.seconds)
    assert seconds[0] > seconds[1]


def test_the_start_temperatures_are_those_of_the_process_as_it_is_told():
    """Burnt again pass by pass from the figures of the process alone."""
    plan = shipped_plan("crown")
    process = plan_process(plan, RIG, STEEL)
    heat = NetHeat(plan.net, STEEL, plan.limits.thickness)
    first = process.folds[:4]
    steps = [f.step for f in first]
    assert all(b - a == 1 for a, b in itertools.pairwise(steps))
    heat.wait_until(sum(c.beam_s for c in process.cuts if c.step < steps[0]))
    for fold in first:
        stroke = (fold.seconds - sum(fold.waits_s)) / fold.passes
        line = 1e3 * process.absorptivity * fold.power_w / fold.speed_mm_s
        for start, wait in zip(fold.start_c, fold.waits_s, strict=True):
            assert heat.start_c(fold.crease) == pytest.approx(start, abs=0.6)
            heat.burn(fold.crease, line)
            heat.wait_until(heat.now_s + stroke + wait)
