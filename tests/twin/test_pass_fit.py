"""Prediction of burnt creases, and the derivatives' independence from where a search begins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigs.material import load_material
from tests.twin.burnt_tables import STEEL, THICKNESS, TRUE, burnt
from twin.heating import bend
from twin.pass_fit import determinable, fit_passes, left_out, predict, unfit_rows

DEFAULTS = {"absorptivity": 0.35, "threshold": 1.0, "half_passes": 83.0}


def test_predictions_are_those_of_the_fast_model_pass_by_pass():
    rows = burnt(passes=(1, 7), thicknesses=(0.075, None)).rows
    found = predict(STEEL, rows, THICKNESS, 0.35, 1.0, 83.0)
    for row, angle in zip(rows, found, strict=True):
        one = bend(
            STEEL, row.thickness_mm or THICKNESS, row.power_w, row.speed_mm_s, spot_mm=0.1, absorptivity=0.35
        )
        law = sum((1.0 + n / one.half_passes) ** -STEEL.forming.fall_off for n in range(row.passes))
        assert angle == pytest.approx(math.degrees(one.angle_rad) * law)


def test_the_search_ends_at_the_same_place_wherever_it_begins():
    rows = burnt(noise=0.05, seed=3).rows
    free = ("absorptivity", "threshold", "half_passes")
    near, far = (fit_passes(rows, STEEL, THICKNESS, DEFAULTS, free, starts=(start,)) for start in (1.0, 2.2))
    for name in free:
        assert near.values[name] == pytest.approx(far.values[name], rel=0.01)
    np.testing.assert_allclose(np.diag(near.correlation), 1.0)


def test_left_out_groups_do_not_see_themselves():
    table = burnt((7.0, 9.0, 11.0), passes=(1, 10))
    rows = list(table.rows)
    shifted = [
        type(r)(r.line, r.power_w, r.speed_mm_s, r.spot_mm, None, r.passes, 20.0,
                r.angle_deg * (1.5 if r.power_w == 9.0 and r.speed_mm_s == 100.0 else 1.0))
        for r in rows
    ]  # fmt: skip
    free = ("absorptivity",)
    blind = left_out(shifted, STEEL, THICKNESS, {**TRUE}, free, "setting")
    for r, value in zip(rows, blind.predicted_deg, strict=True):
        if r.power_w == 9.0 and r.speed_mm_s == 100.0:
            assert value == pytest.approx(r.angle_deg, rel=0.01)
    assert blind.worst == pytest.approx(1.0 / 3.0, rel=0.05)


def test_what_a_table_can_tell():
    assert determinable(burnt().rows)[0] == ("absorptivity", "threshold", "half_passes")
    assert determinable(burnt((9.0,), (100.0,), (5,)).rows)[0] == ("absorptivity",)
    free, why = determinable(burnt((7.0, 9.0), (100.0,), (5,)).rows)
    assert free == ("absorptivity", "threshold") and "passes" in why["half_passes"]


def test_settings_that_cannot_fold_are_named_with_their_regime():
    rows = burnt((9.0, 60.0), (100.0,), (1,)).rows
    assert unfit_rows(load_material("304"), rows, THICKNESS, 0.35) == {1: "cuts"}
