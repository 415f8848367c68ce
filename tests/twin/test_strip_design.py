"""Settings that a strip proposes, and what the model lets pass."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigs.errors import JobError
from rigs.material import load_material, material_names
from rigs.rig import load_rig
from rigs.strip import lay_out
from twin.cooling import crease_rise
from twin.errors import HeatingError
from twin.heating import bend
from twin.strip_design import expected_folds, fold_settings, kerf_settings, rest_between_s

RIG, STEEL = load_rig("grbl-4axis"), load_material("304")


def strip_of(settings, length=8.0):
    return lay_out("fold", settings, RIG, width_mm=8.0, length_mm=length)


@pytest.mark.parametrize("name", [n for n in material_names() if n not in ("1100", "6061")])
def test_proposed_settings_fold_without_melting(name):
    metal = load_material(name)
    settings = fold_settings(RIG, metal, 0.1)
    assert len(settings) == 32 and len({(p, v) for p, v, _ in settings}) == 8
    for power, speed in {(p, v) for p, v, _ in settings}:
        one = bend(metal, 0.1, power, speed, spot_mm=0.1, absorptivity=metal.absorptivity.at_1064nm)
        assert one.regime in ("tgm", "mixed") and one.peak_top_c < 0.82 * metal.constants.solidus_c
    assert fold_settings(RIG, metal, 0.1, repeats=3) == settings * 3


def test_what_is_named_is_taken():
    settings = fold_settings(RIG, STEEL, 0.1, powers=(6.0, 8.0), speeds=(120.0,), passes=(2, 4))
    assert settings == ((6.0, 120.0, 2), (6.0, 120.0, 4), (8.0, 120.0, 2), (8.0, 120.0, 4))
    assert (
        kerf_settings(30.0, 19.0, powers=(15.0,), repeats=2)
        == tuple((15.0, v, 1) for v in (15.0, 21.0, 30.0, 42.0, 60.0)) * 2
    )


def test_expected_angles_are_those_of_the_fast_model():
    settings = ((6.0, 100.0, 1), (9.0, 100.0, 8))
    expected = expected_folds(strip_of(settings), RIG, STEEL, 0.1)
    for angle, (power, speed, passes) in zip(expected.angle_deg, settings, strict=True):
        one = bend(STEEL, 0.1, power, speed, spot_mm=0.1, absorptivity=0.35)
        law = sum((1.0 + n / one.half_passes) ** -1.0 for n in range(passes))
        assert angle == pytest.approx(math.degrees(one.angle_rad) * law)
    assert expected.notes == ()


def test_doubtful_settings_are_told_and_dangerous_ones_refused():
    doubtful = expected_folds(strip_of([(0.3, 100.0, 1), (13.5, 100.0, 1)]), RIG, STEEL, 0.1)
    assert any("1 settings stay below yield" in note for note in doubtful.notes)
    assert any("1 settings melt the surface" in note for note in doubtful.notes)
    with pytest.raises(HeatingError, match=r"piece 1 \(19 W, 20 mm/s\) would cut"):
        expected_folds(strip_of([(19.0, 20.0, 1)]), RIG, STEEL, 0.1)
    with pytest.raises(HeatingError, match="fewer"):
        expected_folds(strip_of([(10.0, 100.0, 200)]), RIG, STEEL, 0.1)
    with pytest.raises(JobError, match="reach the head"):
        expected_folds(strip_of([(6.0, 100.0, 1)], length=230.0), RIG, STEEL, 0.1)
    with pytest.raises(HeatingError, match="no power up to 19 W folds"):
        fold_settings(RIG, STEEL, 0.1, speeds=(0.01,))


def test_fingers_are_cold_again_before_each_pass():
    strip = strip_of([(6.0, 100.0, 20), (9.0, 50.0, 20)])
    rest = rest_between_s(strip, RIG, STEEL, 0.1)
    times = rest * np.arange(1.0, 21.0)
    line = 1e3 * 0.35 * 9.0 / 50.0
    assert 2.0 * crease_rise(times, line, 0.1, STEEL).sum() <= 10.0
    assert 2.0 * crease_rise(0.8 * times, line, 0.1, STEEL).sum() > 10.0
