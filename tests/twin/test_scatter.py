"""Scatter: draws, touch-up, contacts of each draw, shares of creases, and independence of the cores."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from planner.fold_plan import Fold, FoldPlan
from tests.twin.hand_plans import box, breadth_first_net, icosahedron, plan_of, ring_sheet, star
from twin.mjcf_model import compile_model
from twin.scatter import ScatterResult, run_scatter, wilson_interval
from twin.scatter_contact import ContactReplay
from twin.scatter_draws import CHUNK, FoldTurn, ScatterFigures, TouchUp, draw_turns, fold_turns
from twin.scatter_file import read_scatter, scatter_values
from twin.scatter_shares import shape_sensitivity, variance_shares
from twin.shape_error import folded_draws, shape_errors
from twin.sweep import kinematic_sweep

NONE = ScatterFigures(0.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def star_plan() -> FoldPlan:
    return plan_of(breadth_first_net(star()))


@pytest.fixture(scope="module")
def star_result(star_plan: FoldPlan) -> ScatterResult:
    return run_scatter(star_plan, fold_turns(star_plan), draws=200, seed=3, tolerance_rel=0.01)


def test_without_scatter_every_draw_is_the_plan(star_plan: FoldPlan) -> None:
    result = run_scatter(star_plan, fold_turns(star_plan), NONE, TouchUp(sigma_rad=0.0), draws=25)
    assert result.touched_up is not None
    for way in (result.open_loop, result.touched_up):
        assert max(way.shape_rms_mm) < 1e-9
        assert max(way.angle_error_rad) < 1e-12
        assert way.probability == way.contact_free == way.in_tolerance == 1.0
        assert way.pairs == ()
    assert result.open_loop.passes == result.touched_up.passes
    assert result.expected_rms_mm == 0.0


def test_the_result_does_not_depend_on_the_number_of_workers(star_plan: FoldPlan) -> None:
    turns = fold_turns(star_plan)
    one, two, five = (run_scatter(star_plan, turns, draws=130, seed=9, workers=n) for n in (1, 2, 5))
    assert one == two == five
    assert run_scatter(star_plan, turns, draws=130, seed=10) != one


def test_more_draws_begin_with_the_same_ones(star_plan: FoldPlan) -> None:
    turns = fold_turns(star_plan)
    figures, touch = ScatterFigures(), TouchUp()
    first, again, other = (draw_turns(turns, figures, touch, 4, chunk) for chunk in (0, 0, 1))
    np.testing.assert_array_equal(first.open_rad, again.open_rad)
    np.testing.assert_array_equal(first.touched_rad, again.touched_rad)
    assert not np.array_equal(first.open_rad, other.open_rad)


def test_touching_up_brings_every_crease_within_half_a_pass(star_result: ScatterResult) -> None:
    open_loop, touched = star_result.open_loop, star_result.touched_up
    assert touched is not None
    assert touched.shape_rms_mm[1] < 0.2 * open_loop.shape_rms_mm[1]
    assert touched.probability > open_loop.probability
    low, middle, high = open_loop.shape_rms_mm
    assert low < middle < high
    assert open_loop.interval[0] < open_loop.probability < open_loop.interval[1]


@given(
    angle=st.floats(0.2, 1.5),
    count=st.integers(3, 60),
    sheet=st.floats(0.0, 0.1),
    valley=st.booleans(),
)
@settings(max_examples=40)
def test_a_measured_turn_ends_within_half_a_pass(
    angle: float, count: int, sheet: float, valley: bool
) -> None:
    """Perfect measuring, one factor per sheet: half a pass of the real size is the most that is left."""
    sign = 1.0 if valley else -1.0
    turn = FoldTurn(0, 3, sign * angle, (sign * angle / count,) * count)
    drawn = draw_turns(
        [turn], ScatterFigures(sheet, 0.0, 0.0, 0.0), TouchUp(sigma_rad=0.0, measure_from=0.3), 1, 0
    )
    real = drawn.open_rad[:, 0] / count
    left = np.abs(drawn.touched_rad[:, 0] - turn.to_rad)
    bound = np.maximum(0.5 * angle / count, np.abs(real) - 0.5 * angle / count)
    assert np.all(left <= bound + 1e-12)
    assert drawn.open_passes == count
    np.testing.assert_allclose(drawn.touched_rad[:, 0], drawn.touched_passes * real, rtol=1e-12)


def test_open_loop_spread_is_the_sum_of_its_parts() -> None:
    """One crease, many draws: the variance of its angle is that of the lognormal factors and the noise."""
    total, count = np.radians(60.0), 40
    turn = FoldTurn(0, 0, total, (total / count,) * count)
    drawn = [draw_turns([turn], ScatterFigures(), TouchUp(), 1, chunk) for chunk in range(200)]
    error = np.concatenate([d.open_rad[:, 0] for d in drawn]) - total
    sd = total * np.sqrt(0.10**2 + 0.05**2 + 0.08**2 / count + (count * np.radians(0.05) ** 2 / total**2))
    assert np.median(np.abs(error)) == pytest.approx(0.6745 * sd, rel=0.05)
    touched = np.concatenate([d.touched_rad[:, 0] for d in drawn]) - total
    assert np.percentile(np.abs(touched), 95) < total / count


def test_two_turns_of_one_crease_share_its_factor_and_add_up() -> None:
    figures = ScatterFigures(0.0, 0.2, 0.0, 0.0)
    turns = [FoldTurn(0, 7, 0.3, (0.1,) * 3), FoldTurn(5, 7, 0.9, (0.1,) * 6)]
    drawn = draw_turns(turns, figures, TouchUp(), 2, 0)
    np.testing.assert_allclose(drawn.open_rad[:, 1], 3.0 * drawn.open_rad[:, 0], rtol=1e-12)


@pytest.mark.parametrize("name", ["box", "star", "icosahedron"])
def test_the_first_collision_is_that_of_the_sweep(name: str) -> None:
    """Oracle: the kinematic sweep of MuJoCo on a plan with the drawn angles."""
    goal = {"box": box(30, 30, 10), "star": star(), "icosahedron": icosahedron()}[name]
    plan = plan_of(breadth_first_net(goal))
    turns = fold_turns(plan)
    replay = ContactReplay(plan, turns)
    compiled = compile_model(plan)
    rng = np.random.default_rng(11)
    collided = 0
    for _ in range(8):
        scale = np.exp(0.35 * rng.standard_normal(len(turns)))
        angles = np.clip([s * t.to_rad for s, t in zip(scale, turns, strict=True)], -2.9, 2.9)
        drawn = iter(angles.tolist())
        steps = [replace(s, to_rad=next(drawn)) if isinstance(s, Fold) else s for s in plan.steps]
        seen = [
            e
            for e in kinematic_sweep(compiled, replace(plan, steps=tuple(steps))).events
            if e.substrate or not replay.meets[e.faces[0], e.faces[1]]
        ]
        found = replay.first(angles).collision
        assert (found is not None) == bool(seen)
        if found is not None:
            collided += 1
            assert found.step == seen[0].step
            assert abs(found.angle_rad - seen[0].angle_rad) < np.radians(0.5)
            pair = {found.moving, found.still}
            assert any(set(e.faces) == pair for e in seen if e.step == found.step)
    assert collided or name != "box"


def test_a_clean_plan_collides_nowhere_and_seams_are_no_collisions() -> None:
    plan = plan_of(breadth_first_net(box(20, 20, 20)))
    turns = fold_turns(plan)
    replay = ContactReplay(plan, turns)
    planned = np.array([t.to_rad for t in turns])
    assert replay.first(planned) == replay.first(planned)
    assert replay.first(planned).collision is None
    assert replay.first(planned).seam_touches == 0
    assert replay.first(1.05 * planned).seam_touches > 0


def test_what_ends_a_draw_is_told() -> None:
    """Much scatter beside a sheet that is near: pairs, steps and shares fit together."""
    plan = plan_of(breadth_first_net(box(30, 30, 10)))
    tight = replace(plan, sheet=ring_sheet(plan.net, gap=0.5))
    opened = run_scatter(tight, fold_turns(tight), ScatterFigures(sheet=0.3), draws=40, touch_up=False)
    spread = opened.open_loop
    assert opened.touched_up is None
    assert spread.sheet_hits <= 1.0 - spread.contact_free
    assert sum(p.share for p in spread.pairs if p.in_substrate) <= spread.sheet_hits + 1e-12
    apart = run_scatter(
        tight, fold_turns(tight), ScatterFigures(sheet=0.3), draws=40, touch_up=False, sheet=False
    ).open_loop
    assert apart.sheet_hits == 0.0
    assert apart.contact_free >= spread.contact_free
    assert apart.shape_rms_mm == spread.shape_rms_mm
    assert {p.step for p in spread.pairs} <= {n for n, s in enumerate(plan.steps) if isinstance(s, Fold)}


def test_shares_follow_from_finite_differences() -> None:
    plan = plan_of(breadth_first_net(icosahedron()))
    net, turns = plan.net, fold_turns(plan)
    angles = plan.final_angles
    creases = sorted({t.crease for t in turns})
    analytic = np.sqrt((shape_sensitivity(net, angles, creases) ** 2).sum(axis=0) / (3 * len(net.faces)))
    step = 1e-5
    shaken = angles + step * np.eye(len(net.edges))[creases]
    numeric = shape_errors(net, folded_draws(net, shaken))[0] / step
    np.testing.assert_allclose(analytic, numeric, rtol=1e-3)
    shares = variance_shares(net, turns, ScatterFigures())
    assert shares.sheet + sum(c.share for c in shares.creases) == pytest.approx(1.0)
    assert [c.share for c in shares.creases] == sorted((c.share for c in shares.creases), reverse=True)


def test_the_expected_error_is_that_of_many_small_draws() -> None:
    plan = plan_of(breadth_first_net(star()))
    small = ScatterFigures(0.004, 0.003, 0.002, 1e-5)
    turns = fold_turns(plan)
    square = []
    for chunk in range(60):
        drawn = draw_turns(turns, small, TouchUp(), 5, chunk)
        angles = np.zeros((CHUNK, len(plan.net.edges)))
        angles[:, [t.crease for t in turns]] = drawn.open_rad
        square.append(shape_errors(plan.net, folded_draws(plan.net, angles))[0] ** 2)
    expected = variance_shares(plan.net, turns, small).rms_mm
    assert np.sqrt(np.mean(square)) == pytest.approx(expected, rel=0.06)


@given(count=st.integers(1, 2000), share=st.floats(0.0, 1.0))
def test_wilson_solves_its_own_equation(count: int, share: float) -> None:
    """Oracle: the limits are where the normal test of the true probability turns."""
    good = round(share * count)
    low, high = wilson_interval(good, count)
    assert 0.0 <= low <= good / count <= high <= 1.0
    z2 = 1.959963984540054**2

    def excess(p: float) -> float:
        return (good / count - p) ** 2 - z2 * p * (1.0 - p) / count

    if 0 < good < count:
        assert low == pytest.approx(brentq(excess, 0.0, good / count), abs=1e-6)
        assert high == pytest.approx(brentq(excess, good / count, 1.0), abs=1e-6)


def test_plain_values_read_back_the_same(star_result: ScatterResult) -> None:
    values = scatter_values(star_result)
    assert scatter_values(read_scatter(values)) == values
    alone = replace(star_result, touched_up=None)
    assert "touched_up" not in scatter_values(alone)
    assert read_scatter(scatter_values(alone)).touched_up is None


@pytest.mark.parametrize(
    ("arguments", "words"),
    [({"draws": 0}, "draws"), ({"seed": -1}, "seed"), ({"tolerance_rel": 0.0}, "tolerance")],
)
def test_senseless_numbers_are_refused(star_plan: FoldPlan, arguments: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        run_scatter(star_plan, fold_turns(star_plan), **arguments)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="expected 0 to 1"):
        ScatterFigures(sheet=float("nan"))
    with pytest.raises(ValueError, match="sigma"):
        TouchUp(sigma_rad=-1.0)
    with pytest.raises(ValueError, match="measure_from"):
        TouchUp(measure_from=2.0)
