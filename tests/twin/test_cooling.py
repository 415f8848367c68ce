"""Waits between passes against plain superposition."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigs.material import load_material
from twin.cooling import crease_rise, loss_time_s, pass_times
from twin.errors import HeatingError

STEEL = load_material("304")


def test_the_line_source_of_the_reference():
    """75 µm 304, 10 W at 0.35 and 200 mm/s: 25.7, 11.1, 7.44, 4.77, 2.25, 0.97 K after 0.1 to 10 s."""
    rise = crease_rise(np.array([0.1, 0.5, 1.0, 2.0, 5.0, 10.0]), 17.5, 0.075, STEEL)
    assert rise == pytest.approx(np.array([25.7, 11.1, 7.44, 4.77, 2.25, 0.97]), rel=0.15)
    assert loss_time_s(STEEL, 0.075) == pytest.approx(10.0, rel=0.15)


def plain_temperatures(intervals: np.ndarray, line: float, thickness: float) -> np.ndarray:
    begun = np.concatenate([[0.0], np.cumsum(intervals[:-1])])
    out = []
    for n, t in enumerate(begun):
        out.append(20.0 + sum(float(crease_rise(np.array(t - b), line, thickness, STEEL)) for b in begun[:n]))
    return np.array(out)


@given(st.floats(10.0, 80.0), st.floats(0.05, 0.2), st.floats(60.0, 400.0), st.floats(0.05, 1.0))
@settings(max_examples=15)
def test_every_pass_finds_the_crease_cold_enough(line, thickness, allowed, shortest):
    times = pass_times(STEEL, thickness, line, 60, allowed_c=allowed, shortest_s=shortest)
    plain = plain_temperatures(times.interval_s, line, thickness)
    assert np.all(times.interval_s >= shortest - 1e-12)
    assert np.all(plain <= allowed + 0.05)
    assert times.start_c == pytest.approx(plain, abs=1.5)


def test_waits_are_no_longer_than_needed():
    times = pass_times(STEEL, 0.1, 60.0, 60, allowed_c=120.0, shortest_s=0.1)
    waited = np.flatnonzero(times.interval_s[:40] > 0.1) + 1
    assert len(waited) > 5
    assert np.all(times.start_c[waited] > 119.0)


def test_colder_takes_longer():
    total = [
        pass_times(STEEL, 0.1, 50.0, 80, allowed_c=c, shortest_s=0.1).interval_s.sum()
        for c in (80, 120, 200, 300)
    ]
    assert total == sorted(total, reverse=True)
    assert total[0] > total[-1]


def test_few_passes_and_the_steady_state():
    one = pass_times(STEEL, 0.1, 50.0, 1, allowed_c=100.0, shortest_s=0.1)
    assert one.interval_s.tolist() == [0.1]
    assert one.start_c.tolist() == [20.0]
    many = pass_times(STEEL, 0.1, 50.0, 1500, allowed_c=100.0, shortest_s=0.1)
    few = pass_times(STEEL, 0.1, 50.0, 100, allowed_c=100.0, shortest_s=0.1)
    assert many.interval_s[:99] == pytest.approx(few.interval_s[:99])
    assert many.start_c.max() <= 100.0 + 1e-9


@pytest.mark.parametrize("allowed", [20.0, -5.0, math.nan])
def test_it_never_gets_colder_than_the_room(allowed):
    with pytest.raises(HeatingError, match="ambient"):
        pass_times(STEEL, 0.1, 50.0, 3, allowed_c=allowed, shortest_s=0.1)
