"""A calibration counts only for what was burnt."""

from __future__ import annotations

import msgspec
import pytest

from rigs.material import Calibration
from tests.rigs.made_jobs import made_plan
from tests.twin.burnt_tables import STEEL
from twin.calibration_scope import calibration_holds
from twin.plan_process import plan_process
from twin.validation import validate

FITTED = msgspec.structs.replace(
    STEEL,
    calibration=Calibration(status="fitted", source="a strip", thickness_mm=(0.1,), wavelength_nm=1064.0),
    grades={**STEEL.grades, "forming": msgspec.structs.replace(STEEL.grades["forming"], grade="A")},
)
HERE = {"thickness_mm": 0.1, "wavelength_nm": 1064.0, "absorptivity": 0.35, "heating": "fast"}


def test_it_holds_for_what_was_burnt():
    assert calibration_holds(FITTED, **HERE) == ("fitted", "")
    assert calibration_holds(FITTED, **{**HERE, "thickness_mm": 0.103})[0] == "fitted"


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"thickness_mm": 0.2}, "0.1 mm were burnt"),
        ({"wavelength_nm": 10600.0, "absorptivity": 0.1}, "10600 nm"),
        ({"absorptivity": 0.4}, "another absorptivity"),
        ({"heating": "section"}, "section model"),
    ],
)
def test_it_does_not_hold_elsewhere(change, word):
    status, why = calibration_holds(FITTED, **{**HERE, **change})
    assert status == "none" and word in why and "does not hold" in why


def test_an_unfitted_material_says_so():
    status, why = calibration_holds(STEEL, **HERE)
    assert status == "none" and "not calibrated" in why


@pytest.mark.parametrize(("material", "status", "grade"), [(STEEL, "none", "C"), (FITTED, "fitted", "A")])
def test_the_process_takes_it_over(material, status, grade):
    from rigs.rig import load_rig

    rig, plan = load_rig("grbl-4axis"), made_plan()
    process = plan_process(plan, rig, material)
    assert (process.calibration, process.grade) == (status, grade)
    assert any("calibrated" in flag for flag in process.flags) == (status == "none")
    certificate = validate(plan, process, rig, material, draws=2)
    assert certificate.process == ("calibrated" if status == "fitted" else "uncalibrated")
    assert (certificate.calibration, certificate.grade) == (status, grade)
    assert certificate.flags == process.flags and certificate.model_sha256


def test_another_thickness_is_graded_as_a_guess():
    from rigs.limits import machine_limits
    from rigs.rig import load_rig
    from tests.twin.hand_plans import box, breadth_first_net, plan_of

    rig = load_rig("grbl-4axis")
    plan = plan_of(breadth_first_net(box()), limits=machine_limits(rig, FITTED, 0.08))
    process = plan_process(plan, rig, FITTED)
    assert (process.calibration, process.grade) == ("none", "C")
    assert any("the sheet is 0.08 mm" in flag for flag in process.flags)
