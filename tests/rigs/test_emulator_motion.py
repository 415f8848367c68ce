"""Motion of the emulator: laws of acceleration-limited moves."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from rigs.emulator.motion import Motion, Segment

LENGTHS = st.floats(0.01, 200.0)
SPEEDS = st.floats(0.5, 200.0)
ACCELS = st.floats(10.0, 3000.0)
MOVES = st.lists(st.tuples(LENGTHS, st.floats(0.0, 6.28), SPEEDS), min_size=1, max_size=12)


def queue(moves: list[tuple[float, float, float]], accel: float) -> Motion:
    motion = Motion((0.0, 0.0))
    for length, angle, speed in moves:
        unit = (math.cos(angle), math.sin(angle))
        motion.add(Segment(motion.end, unit, length, speed, accel), 0.0)
    return motion


def finish(motion: Motion) -> list[tuple[float, float, Segment]]:
    while (event := motion.next_event()) is not None:
        motion.advance(event)
    return motion.finished


@given(LENGTHS, SPEEDS, ACCELS)
def test_single_move_takes_the_time_of_its_trapezoid(length: float, speed: float, accel: float) -> None:
    done = finish(queue([(length, 0.0, speed)], accel))
    if speed**2 / accel <= length:
        expected = length / speed + speed / accel
    else:
        expected = 2.0 * math.sqrt(length / accel)
    assert math.isclose(done[0][1], expected, rel_tol=1e-9)


@given(MOVES, ACCELS)
def test_speeds_are_continuous_and_within_limits(
    moves: list[tuple[float, float, float]], accel: float
) -> None:
    motion = queue(moves, accel)
    end = motion.end
    done = finish(motion)
    assert math.dist(motion.position, end) < 1e-6
    speed, clock = 0.0, 0.0
    for start, stop, segment in done:
        assert math.isclose(start, clock, abs_tol=1e-9)
        assert math.isclose(segment.v_in, speed, abs_tol=1e-6)
        assert segment.v_top <= segment.speed * (1 + 1e-9)
        for a, b in ((segment.v_in, segment.v_top), (segment.v_top, segment.v_out)):
            assert abs(b * b - a * a) <= 2.0 * accel * segment.length * (1 + 1e-6) + 1e-6
        speed, clock = segment.v_out, stop
    assert abs(speed) < 1e-6


@given(MOVES, ACCELS, st.floats(0.0, 1.0))
def test_adding_late_ends_where_adding_early_does(
    moves: list[tuple[float, float, float]], accel: float, share: float
) -> None:
    early = queue(moves, accel)
    late = Motion((0.0, 0.0))
    now = 0.0
    for length, angle, speed in moves:
        late.add(Segment(late.end, (math.cos(angle), math.sin(angle)), length, speed, accel), now)
        event = late.next_event()
        if event is not None:
            now += share * (event - now)
            late.advance(now)
    finish(late)
    finish(early)
    assert math.dist(late.position, early.position) < 1e-6
    assert math.isclose(
        sum(s.length for _, _, s in late.finished), sum(length for length, _, _ in moves), rel_tol=1e-9
    )


@given(MOVES, ACCELS, st.floats(0.0, 0.999))
def test_hold_brakes_on_the_path_and_resume_completes_it(
    moves: list[tuple[float, float, float]], accel: float, share: float
) -> None:
    motion = queue(moves, accel)
    end = motion.end
    length = sum(m[0] for m in moves)
    now = share * sum(s.seconds for s in motion.queue)
    motion.advance(now)
    before, speed = sum(s.length for _, _, s in motion.finished), motion.state(now)[1]
    if motion.moving:
        before += motion.queue[0].at(now - motion.since)[0]
    motion.hold(now)
    while (event := motion.next_event()) is not None:
        motion.advance(event)
        now = event
    assert motion.state(now)[1] == 0.0
    braked = sum(s.length for _, _, s in motion.finished) - before
    assert math.isclose(braked, speed**2 / (2.0 * accel), rel_tol=1e-6, abs_tol=1e-6)
    motion.resume(now)
    finish(motion)
    assert math.dist(motion.position, end) < 1e-6
    assert math.isclose(sum(s.length for _, _, s in motion.finished), length, rel_tol=1e-6)


def test_straight_corner_is_taken_at_full_speed_and_a_reversal_stops() -> None:
    straight = queue([(50.0, 0.0, 20.0), (50.0, 0.0, 20.0)], 1000.0)
    assert straight.queue[0].v_out == 20.0
    back = queue([(50.0, 0.0, 20.0), (50.0, math.pi, 20.0)], 1000.0)
    assert back.queue[0].v_out == 0.0
