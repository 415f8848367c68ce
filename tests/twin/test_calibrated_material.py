"""A fitted material carries its values, its grade and where they come from."""

from __future__ import annotations

import pytest

from rigs.material import parse_material
from rigs.profile_writer import profile_toml
from tests.twin.burnt_tables import STEEL, THICKNESS, burnt
from twin.calibrated_material import calibrated_material
from twin.calibration import calibrate


def test_values_and_grades_are_those_of_the_fit():
    fit = calibrate(burnt(repeats=2, noise=0.05, seed=6), STEEL, THICKNESS)
    fitted = calibrated_material(fit, STEEL)
    assert fitted.absorptivity.at_1064nm == pytest.approx(fit.value("absorptivity"), abs=1e-6)
    assert fitted.absorptivity.at_10600nm == STEEL.absorptivity.at_10600nm
    assert fitted.forming.threshold == pytest.approx(fit.value("threshold"), abs=1e-6)
    assert fitted.forming.half_passes == pytest.approx(fit.value("half_passes"), abs=1e-4)
    assert fitted.forming.scatter_crease == pytest.approx(fit.scatter_crease, abs=1e-4)
    assert fitted.calibration.status == "fitted" and fitted.calibration.thickness_mm == (THICKNESS,)
    assert "64 creases of strip.csv" in fitted.calibration.source
    assert fitted.grades["forming"].grade == fitted.grades["absorptivity"].grade == fit.grade
    assert fitted.grades["table"] == STEEL.grades["table"] and fitted.table == STEEL.table
    assert fitted.sha256 != STEEL.sha256


def test_the_file_reads_back_as_the_same_material():
    fitted = calibrated_material(calibrate(burnt(), STEEL, THICKNESS), STEEL)
    assert parse_material(profile_toml(fitted, "two\nlines")) == fitted


def test_co2_light_has_its_own_absorptivity():
    table = burnt((20.0, 25.0, 30.0), truth={"absorptivity": 0.12, "threshold": 1.0, "half_passes": 83.0})
    fitted = calibrated_material(calibrate(table, STEEL, THICKNESS, wavelength_nm=10600.0), STEEL)
    assert fitted.absorptivity.at_10600nm == pytest.approx(0.12, rel=0.01)
    assert fitted.absorptivity.at_1064nm == STEEL.absorptivity.at_1064nm
