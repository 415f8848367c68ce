"""Times of moves against plain integration of the same limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs.motion_time import line_seconds, line_time_at, polyline_seconds

lengths = st.floats(0.01, 500.0)
speeds = st.floats(1.0, 500.0)
accels = st.floats(50.0, 5000.0)


def stepped_seconds(length: float, speed: float, accel: float, steps: int = 200_000) -> float:
    """Integrate dx / v over a straight move with the speed that both ends allow."""
    x = (np.arange(steps) + 0.5) * length / steps
    v = np.minimum(speed, np.sqrt(2.0 * accel * np.minimum(x, length - x)))
    return float(np.sum(length / steps / v))


@pytest.mark.parametrize(
    "case", [(10.0, 50.0, 500.0), (1.0, 50.0, 500.0), (100.0, 5.0, 20.0), (5.0, 50.0, 500.0)]
)
def test_a_straight_move_takes_as_long_as_its_integral(case):
    assert line_seconds(*case) == pytest.approx(stepped_seconds(*case), rel=3e-3)


@given(lengths, speeds, accels)
def test_place_over_time_is_symmetric_and_rises(length, speed, accel):
    total = line_seconds(length, speed, accel)
    places = np.linspace(0.0, length, 21)
    times = np.array([line_time_at(float(p), length, speed, accel) for p in places])
    assert times[0] == pytest.approx(0.0, abs=1e-9)
    assert times[-1] == pytest.approx(total, rel=1e-9)
    assert np.all(np.diff(times) > 0.0)
    assert np.allclose(times + times[::-1], total, rtol=1e-7)


@given(lengths, speeds, accels, st.integers(1, 8))
def test_a_straight_polyline_is_one_line(length, speed, accel, parts):
    x = np.linspace(0.0, length, parts + 1)
    points = np.stack([x, 0 * x, 0 * x], axis=1)
    seconds = polyline_seconds(points, speed, np.full(3, accel))
    assert seconds == pytest.approx(line_seconds(length, speed, accel), rel=1e-6)


@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=2, max_size=12), speeds, accels)
def test_a_polyline_lies_between_never_stopping_and_always_stopping(corners, speed, accel):
    points = np.array([(round(x, 2), round(y, 2), 0.0) for x, y in corners])
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    steps = steps[steps > 1e-9]
    seconds = polyline_seconds(points, speed, np.full(3, accel))
    slowest = sum(line_seconds(float(s), speed, accel) for s in steps)
    # Diagonal moves may use both axes: up to sqrt(2) times the acceleration of one.
    assert seconds <= slowest * (1 + 1e-6)
    assert (
        seconds >= line_seconds(float(steps.sum()), speed, 1.4143 * accel) * (1 - 1e-6)
        if len(steps)
        else True
    )


def test_a_sharper_corner_takes_longer():
    def corner(degrees: float) -> float:
        a = np.radians(degrees)
        points = np.array([[0, 0, 0], [20, 0, 0], [20 + 20 * np.cos(a), 20 * np.sin(a), 0]])
        return polyline_seconds(points, 50.0, np.full(3, 1e3))

    assert corner(0) < corner(90) < corner(180)  # along an axis each: the same acceleration


def test_no_move_takes_no_time():
    assert polyline_seconds(np.zeros((3, 3)), 10.0, np.ones(3)) == 0.0
    assert line_seconds(0.0, 10.0, 100.0) == 0.0
