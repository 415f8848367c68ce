"""The closed form of one pass: laws, published anchors, regimes and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rigs.material import load_material
from twin.errors import HeatingError, TwinError
from twin.heating import REGIMES, bend, fold_passes, require_fold, soft_threshold, start_factor
from twin.hot_metal import HotMetal, melting_heat

STEEL = load_material("304")


def degrees_of(
    power: float, speed: float, thickness: float = 0.075, spot: float = 0.1, **more: float
) -> float:
    return math.degrees(
        bend(STEEL, thickness, power, speed, spot_mm=spot, absorptivity=0.35, **more).angle_rad
    )


@pytest.mark.parametrize(("power", "speed", "closed_form"), [(10.0, 100.0, 0.85), (5.0, 50.0, 0.47)])
def test_the_closed_form_of_the_reference(power, speed, closed_form):
    """75 µm, w 60 µm: the same formula with the constants that its factors were fitted with."""
    assert degrees_of(power, speed, spot=0.12) == pytest.approx(closed_form, rel=0.08)


@pytest.mark.parametrize(("power", "speed", "fem"), [(10.0, 100.0, 0.912), (5.0, 50.0, 0.632)])
def test_the_finite_element_anchors(power, speed, fem):
    """3-D CalculiX runs, 304 annealed, 75 µm, w 60 µm, absorptivity 0.35; uncalibrated bounds are 30 %."""
    assert degrees_of(power, speed, spot=0.12) == pytest.approx(fem, rel=0.32)


def test_powers_of_first_yield():
    """Section model, 75 µm, w 50 µm."""
    table = fold_passes(STEEL, 0.075, 10.0, [20, 50, 100, 200, 400, 800], across_mm=0.05, absorptivity=0.35)
    assert table.threshold_w == pytest.approx(np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.9]), rel=0.25)


@pytest.mark.parametrize(
    ("power", "speed", "worth"), [(10, 200, 47 / 1.04), (14, 200, 60), (15, 400, 40 / 1.2), (8, 100, 60)]
)
def test_sixty_passes_are_worth_what_the_hardening_chains_gave(power, speed, worth):
    """Chains of the section model with Voce hardening Q = 200 MPa: sum over 60 passes in first passes."""
    half = bend(STEEL, 0.075, power, speed, spot_mm=0.1, absorptivity=0.35).half_passes
    assert np.sum(1.0 / (1.0 + np.arange(60) / half)) == pytest.approx(worth, rel=0.12)


def test_the_angle_collapses_over_the_fourier_number():
    """Angle over the two-layer formula falls at least tenfold from Fo 0.05 to 3."""
    h, w = 0.1, 0.05
    metal = HotMetal.reference(STEEL)

    def share(fourier: float) -> float:
        speed = metal.diffusivity * 2 * w * 1e-3 / (fourier * (h * 1e-3) ** 2) * 1e3
        power = 0.02 * speed  # one line energy, below the cut
        table = fold_passes(STEEL, h, power, speed, across_mm=w, absorptivity=0.35)
        assert float(table.fourier) == pytest.approx(fourier)
        two_layer = 3 * metal.expansion * 0.35 * 20.0 / (metal.heat_capacity * (h * 1e-3) ** 2)
        soft = float(soft_threshold(power / table.threshold_w))
        return float(table.angle_rad) / two_layer / soft

    assert share(0.05) > 10 * share(3.0)


@given(st.floats(2.0, 10.0), st.floats(100.0, 800.0), st.floats(0.05, 0.2), st.floats(1.02, 1.4))
@settings(max_examples=40)
def test_thicker_bends_less_and_hotter_more(power, speed, thickness, factor):
    here = bend(STEEL, thickness, power, speed, spot_mm=0.1, absorptivity=0.35)
    thick = bend(STEEL, thickness * factor, power, speed, spot_mm=0.1, absorptivity=0.35)
    strong = bend(STEEL, thickness, power * factor, speed, spot_mm=0.1, absorptivity=0.35)
    assume(all(r.regime in ("tgm", "mixed", "melts") for r in (here, thick, strong)))
    assert thick.angle_rad < here.angle_rad < strong.angle_rad
    assert strong.peak_top_c > here.peak_top_c


@given(st.floats(0.5, 20.0), st.floats(5.0, 1000.0), st.floats(0.04, 0.25), st.floats(20.0, 400.0))
@settings(max_examples=40)
def test_every_setting_has_an_answer(power, speed, thickness, start):
    result = bend(STEEL, thickness, power, speed, spot_mm=0.1, absorptivity=0.35, start_c=start)
    assert result.regime in REGIMES
    assert 0.0 <= result.angle_rad < math.pi
    assert result.peak_bottom_c <= result.peak_top_c + 1e-6
    if result.valid:
        assert result.regime in ("tgm", "mixed")
        assert require_fold(result) is result
    else:
        with pytest.raises(HeatingError, match=result.regime):
            require_fold(result)


def test_power_and_absorptivity_count_as_their_product():
    a = bend(STEEL, 0.1, 10.0, 100.0, spot_mm=0.1, absorptivity=0.30)
    b = bend(STEEL, 0.1, 7.5, 100.0, spot_mm=0.1, absorptivity=0.40)
    assert a.angle_rad == pytest.approx(b.angle_rad, rel=1e-9)
    assert a.peak_top_c == pytest.approx(b.peak_top_c, rel=1e-9)


def test_one_by_one_equals_all_at_once():
    power, speed = np.meshgrid([3.0, 6.0, 12.0], [40.0, 120.0, 400.0])
    table = fold_passes(STEEL, 0.1, power, speed, across_mm=0.06, along_mm=0.05, absorptivity=0.35)
    for i in range(3):
        for j in range(3):
            one = fold_passes(
                STEEL, 0.1, power[i, j], speed[i, j], across_mm=0.06, along_mm=0.05, absorptivity=0.35
            )
            for name in ("angle_rad", "peak_top_c", "peak_bottom_c", "threshold_w", "half_passes"):
                assert getattr(table, name)[i, j] == pytest.approx(float(getattr(one, name)), rel=1e-9)


@pytest.mark.parametrize(
    ("power", "speed", "regime", "words"),
    [
        (20.0, 20.0, "cuts", "cut"),
        (20.0, 400.0, "melts", "melts"),
        (0.2, 200.0, "below yield", "0 degrees"),
        (2.0, 20.0, "buckling", "sign"),
        (8.0, 400.0, "tgm", ""),
        (8.0, 100.0, "mixed", ""),
    ],
)
def test_regimes(power, speed, regime, words):
    result = bend(STEEL, 0.075, power, speed, spot_mm=0.1, absorptivity=0.35)
    assert result.regime == regime
    assert words in " ".join(result.flags)
    assert result.valid == (regime in ("tgm", "mixed"))
    if regime in ("cuts", "below yield"):
        assert result.angle_rad == 0.0


def test_a_fine_spot_on_thick_metal_upsets_instead_of_buckling():
    result = bend(STEEL, 0.2, 2.0, 5.0, spot_mm=0.1, absorptivity=0.35)
    assert result.regime == "upsetting"


def test_cuts_begin_at_the_line_energy_that_melts_the_kerf():
    """75 µm with a 100 µm kerf: about 190 J/m of light at absorptivity 0.35."""
    line = melting_heat(STEEL) * 75e-6 * 100e-6 / 0.35
    assert line == pytest.approx(190.0, rel=0.1)
    speed = 500.0
    hot = bend(STEEL, 0.075, 1.01 * line * speed * 1e-3, speed, spot_mm=0.1, absorptivity=0.35)
    assert hot.regime == "cuts"


BAD = [0.0, -1.0, math.nan, math.inf]


@pytest.mark.parametrize("name", ["thickness_mm", "power_w", "speed_mm_s", "spot_mm", "absorptivity"])
@pytest.mark.parametrize("value", BAD)
def test_impossible_figures_are_refused(name, value):
    good = {"thickness_mm": 0.1, "power_w": 10.0, "speed_mm_s": 100.0, "spot_mm": 0.1, "absorptivity": 0.35}
    with pytest.raises(HeatingError) as caught:
        bend(STEEL, **(good | {name: value}))
    assert isinstance(caught.value, (TwinError, ValueError))


@pytest.mark.parametrize(
    "more",
    [
        {"absorptivity": 1.01},
        {"start_c": 700.0},
        {"start_c": math.nan},
        {"tilt_rad": 1.5},
        {"tilt_rad": -0.1},
    ],
)
def test_figures_out_of_range_are_refused(more):
    good = {"spot_mm": 0.1, "absorptivity": 0.35}
    with pytest.raises(HeatingError):
        bend(STEEL, 0.1, 10.0, 100.0, **(good | more))


def test_a_tilted_beam_is_wider_and_colder():
    straight = bend(STEEL, 0.1, 10.0, 100.0, spot_mm=0.1, absorptivity=0.35)
    tilted = bend(STEEL, 0.1, 10.0, 100.0, spot_mm=0.1, absorptivity=0.35, tilt_rad=math.radians(45))
    assert tilted.peak_top_c < straight.peak_top_c
    assert tilted.threshold_w > straight.threshold_w
    assert tilted.angle_rad == pytest.approx(straight.angle_rad, rel=0.05)


def test_warm_metal_bends_a_little_less():
    assert float(start_factor(200.0)) == pytest.approx(0.92)
    assert float(start_factor(0.0)) == 1.0
    assert degrees_of(8, 100, start_c=200.0) < degrees_of(8, 100)


def test_doubtful_conditions_are_said():
    def flags(material: str, absorptivity: float, thickness: float = 0.1, spot: float = 0.1) -> str:
        loaded = load_material(material)
        return " ".join(bend(loaded, thickness, 8.0, 200.0, spot_mm=spot, absorptivity=absorptivity).flags)

    assert "coat" in flags("304", 0.1)
    assert "temper" in flags("304/full-hard", 0.35)
    assert "outside the fitted" in flags("304", 0.35, thickness=0.5)
    assert "thicknesses wide" in flags("304", 0.35, spot=1.2)
    assert "Fourier" in flags("6061", 0.35)
