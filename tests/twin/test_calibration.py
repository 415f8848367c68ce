"""A fit to a burnt strip finds what the strip was made with, and says what it does not know."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rigs.errors import ProfileError
from tests.twin.burnt_tables import STEEL, THICKNESS, TRUE, burnt
from twin.calibration import Fit, calibrate
from twin.calibration_table import BurntCrease, CalibrationTable
from twin.errors import CalibrationError
from twin.pass_fit import predict


def names_of(fit: Fit) -> list[str]:
    return [p.name for p in fit.parameters if p.fitted]


def test_a_clean_table_gives_the_parameters_back():
    fit = calibrate(burnt(), STEEL, THICKNESS)
    for name, value in TRUE.items():
        assert fit.value(name) == pytest.approx(value, rel=1e-3)
    assert fit.rms < 1e-3 and fit.left_out.rms < 0.01 and fit.grade == "A" and fit.scatter_crease is None


@pytest.mark.parametrize("seed", range(4))
def test_a_scattered_table_gives_absorptivity_within_ten_per_cent(seed):
    fit = calibrate(burnt(noise=0.06, seed=seed), STEEL, THICKNESS)
    by_name = {p.name: p for p in fit.parameters}
    assert fit.value("absorptivity") == pytest.approx(TRUE["absorptivity"], rel=0.10)
    assert fit.value("threshold") == pytest.approx(TRUE["threshold"], rel=0.30)
    for name, truth in TRUE.items():
        if by_name[name].fitted:  # within four of the deviations that the fit states itself
            assert abs(math.log(fit.value(name) / truth)) < 4.0 * by_name[name].sigma
    assert 0.02 < fit.left_out.rms < 0.15


def test_a_left_out_setting_is_predicted():
    table = burnt(noise=0.06, seed=4)
    seen = CalibrationTable(table.name, tuple(r for r in table.rows if r.power_w != 11.0), ())
    fit = calibrate(seen, STEEL, THICKNESS)
    unseen = [r for r in burnt().rows if r.power_w == 11.0 and r.passes == 20]
    values = {p.name: p.value for p in fit.parameters}
    found = predict(STEEL, unseen, THICKNESS, **values)
    np.testing.assert_allclose(found, [r.angle_deg for r in unseen], rtol=0.15)


def test_a_table_of_another_model_is_predicted_too():
    """The section model stands for metal: it knows nothing of the pass law and threshold that are fitted."""
    from twin.section_model import SectionCase, section_passes

    rows = []
    for power, speed in ((4.0, 50.0), (6.0, 50.0), (8.0, 50.0), (5.0, 100.0), (7.0, 100.0), (9.0, 100.0)):
        chain = section_passes([SectionCase(STEEL, THICKNESS, power, speed, 0.1, 0.40)], 15)[0].angle_rad
        for passes in (1, 6, 15):
            angle = math.degrees(float(chain[:passes].sum()))
            rows.append(BurntCrease(len(rows) + 2, power, speed, 0.1, None, passes, 20.0, angle))
    fit = calibrate(CalibrationTable("section.csv", tuple(rows), ()), STEEL, THICKNESS)
    uncalibrated = predict(STEEL, rows, THICKNESS, 0.35, 1.0, 83.0)
    measured = np.array([row.angle_deg for row in rows])
    before = np.sqrt(np.mean(((uncalibrated - measured) / np.maximum(measured, 1.0)) ** 2))
    assert fit.left_out.rms < 0.15 < before
    assert fit.rms < 0.5 * before


def test_one_wild_row_does_not_spoil_it():
    table = burnt(noise=0.03, seed=1)
    rows = list(table.rows)
    rows[7] = replace(rows[7], angle_deg=90.0)
    fit = calibrate(CalibrationTable(table.name, tuple(rows), ()), STEEL, THICKNESS)
    assert fit.value("absorptivity") == pytest.approx(TRUE["absorptivity"], rel=0.10)
    assert any("line 9 stands alone: 90.0° measured" in note for note in fit.notes)


@pytest.mark.parametrize(
    ("table", "fitted", "word"),
    [
        (burnt((9.0,), (100.0,), (5,)), ["absorptivity"], "one setting only"),
        (burnt((9.0,), (100.0,), (1, 5, 20, 60, 100)), ["absorptivity", "half_passes"], "one setting only"),
        (burnt(passes=(5,)), ["absorptivity", "threshold"], ""),
        (burnt(truth={**TRUE, "threshold": 1.0}), ["absorptivity", "half_passes"], ""),
    ],
)
def test_what_the_table_does_not_tell_keeps_its_default(table, fitted, word):
    fit = calibrate(table, STEEL, THICKNESS)
    assert names_of(fit) == fitted
    for p in fit.parameters:
        if not p.fitted:
            assert p.value == pytest.approx({"threshold": 1.0, "half_passes": 83.0}[p.name]) and p.why
            assert p.sigma == 0.0
    if word:
        assert fit.grade == "C" and any(word in note for note in fit.notes)
        assert math.isnan(fit.left_out.rms)


def test_repeats_tell_the_scatter():
    fit = calibrate(burnt(repeats=3, noise=0.06, seed=2), STEEL, THICKNESS)
    assert fit.scatter_crease == pytest.approx(0.06, rel=0.35)


@pytest.mark.parametrize(("by", "groups"), [("setting", 16), ("speed", 2), ("thickness", 2)])
def test_groups_are_left_out_whole(by, groups):
    table = burnt(thicknesses=(0.1, 0.15), passes=(1, 10))
    fit = calibrate(table, STEEL, THICKNESS, leave_out=by)
    assert fit.left_out.groups == groups and fit.left_out.rms < 0.01
    assert fit.thicknesses_mm == (0.1, 0.15)
    assert fit.grade == ("A" if groups > 2 else "C")  # two groups are too few to be sure


def test_light_of_another_wavelength_starts_at_its_own_absorptivity():
    lit = {**TRUE, "absorptivity": 0.12}
    table = burnt((20.0, 25.0, 30.0), truth=lit)
    fit = calibrate(table, STEEL, THICKNESS, wavelength_nm=10600.0)
    assert fit.value("absorptivity") == pytest.approx(0.12, rel=0.01)
    with pytest.raises(ProfileError, match="450 nm"):
        calibrate(table, STEEL, THICKNESS, wavelength_nm=450.0)


def test_settings_that_melt_by_the_model_are_named():
    fit = calibrate(burnt((9.0, 18.0)), STEEL, THICKNESS)
    assert any("8 rows (lines 6, 7, 8, 9, 14, 15, 16, 17) melt the surface" in note for note in fit.notes)


def test_absorptivity_at_its_limit_is_said():
    table = burnt((4.0, 5.0, 6.0), truth={"absorptivity": 1.0, "threshold": 1.0, "half_passes": 83.0})
    fit = calibrate(table, STEEL, THICKNESS)
    assert any("absorptivity ran to 1" in note for note in fit.notes)
    rows = tuple(replace(r, angle_deg=3.0 * r.angle_deg) for r in table.rows)
    with pytest.raises(CalibrationError, match="does not follow these angles although absorptivity ran to 1"):
        calibrate(CalibrationTable(table.name, rows, ()), STEEL, THICKNESS)


def test_nothing_to_fit_is_refused():
    table = burnt(passes=(1,))
    flat = CalibrationTable(table.name, tuple(replace(r, angle_deg=0.0) for r in table.rows), ())
    with pytest.raises(CalibrationError, match="every angle is 0"):
        calibrate(flat, STEEL, THICKNESS)
    with pytest.raises(CalibrationError, match="thickness"):
        calibrate(table, STEEL, 0.0)
