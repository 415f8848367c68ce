"""Acceleration-limited motion with look-ahead, as Grbl's planner does it, in closed form.

A queue of straight segments, each with a trapezoid speed profile. Junction speeds follow Grbl's junction
deviation (planner.c, "junction_deviation"). All lengths are Euclidean over all axes, degrees included:
that is what the firmware does with mixed moves.
"""

from __future__ import annotations

import itertools
import math
from collections import deque
from dataclasses import dataclass, field

__all__ = ["Motion", "Segment"]

Vector = tuple[float, ...]
_STOP = 1e-9


@dataclass
class Segment:
    """A straight move; times and speeds are filled in by the planner.

    Attributes:
        start: position where it begins, axis units.
        unit: direction, a unit vector over all axes.
        length: of the move.
        speed: nominal speed, units/s.
        accel: acceleration, units/s^2.
        junction: largest speed at its start that the corner allows.
        programmed: speed that the feed word asked for (0 for rapids).
        limit: fastest that the axes allow, units/s; overrides never pass it.
        s: laser power word; ``mode`` 3, 4 or 5 is the laser modal state.
        rapid: True for G0.
        trip: distance at which a limit switch closes, or None.
        v_in: speed at its start; ``v_top`` reached; ``v_out`` at its end.
    """

    start: Vector
    unit: Vector
    length: float
    speed: float
    accel: float
    programmed: float = 0.0
    s: float = 0.0
    mode: int = 5
    rapid: bool = False
    trip: float | None = None
    limit: float = math.inf
    junction: float = 0.0
    v_in: float = 0.0
    v_top: float = 0.0
    v_out: float = 0.0

    def shape(self) -> None:
        """Set the top speed from the speeds at both ends."""
        square = (2.0 * self.accel * self.length + self.v_in**2 + self.v_out**2) / 2.0
        self.v_top = max(min(self.speed, math.sqrt(square)), self.v_in, self.v_out)

    def times(self) -> tuple[float, float, float]:
        """Seconds of acceleration, cruise and deceleration."""
        up = (self.v_top - self.v_in) / self.accel
        down = (self.v_top - self.v_out) / self.accel
        ramps = (self.v_top + self.v_in) / 2.0 * up + (self.v_top + self.v_out) / 2.0 * down
        cruise = max(self.length - ramps, 0.0) / self.v_top if self.v_top > 0.0 else 0.0
        return up, cruise, down

    @property
    def seconds(self) -> float:
        """Duration."""
        return sum(self.times())

    def at(self, t: float) -> tuple[float, float]:
        """Distance and speed ``t`` seconds after the start."""
        up, cruise, down = self.times()
        if t <= up:
            return self.v_in * t + self.accel * t * t / 2.0, self.v_in + self.accel * t
        d = (self.v_in + self.v_top) / 2.0 * up
        if t <= up + cruise:
            return d + self.v_top * (t - up), self.v_top
        left = max(up + cruise + down - t, 0.0)
        return (
            self.length - self.v_out * left - self.accel * left * left / 2.0,
            self.v_out + self.accel * left,
        )

    def point(self, distance: float) -> Vector:
        """Position at a distance along the move."""
        return tuple(p + u * distance for p, u in zip(self.start, self.unit, strict=True))

    def after(self, distance: float, speed: float) -> Segment:
        """What is left behind ``distance``, entered at ``speed``."""
        return Segment(
            self.point(distance), self.unit, self.length - distance, self.speed, self.accel, self.programmed,
            self.s, self.mode, self.rapid, None if self.trip is None else self.trip - distance, self.limit,
            speed, speed, 0.0, 0.0,
        )  # fmt: skip

    def reaches(self, distance: float) -> float | None:
        """Seconds after its start at which the move has gone a distance, or None if it never does."""
        if distance > self.length:
            return None
        low, high = 0.0, self.seconds
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.at(middle)[0] < distance else (low, middle)
        return high


@dataclass
class Motion:
    """The queue: what moves now, what comes after, and where the machine is.

    Attributes:
        position: of the machine when nothing moves, else at the start of the current segment.
        deviation: junction deviation ($11), mm.
        queue: segments; the first one is moving since ``since``.
        finished: segments (start time, end time, segment) that ended; the owner takes them out.
        held: None, or how many segments still run before the machine stands still.
    """

    position: Vector
    deviation: float = 0.01
    queue: deque[Segment] = field(default_factory=deque)
    since: float = 0.0
    finished: list[tuple[float, float, Segment]] = field(default_factory=list)
    held: int | None = None

    @property
    def end(self) -> Vector:
        """Position after everything in the queue."""
        return self.queue[-1].point(self.queue[-1].length) if self.queue else self.position

    @property
    def moving(self) -> bool:
        """True while something moves."""
        return bool(self.queue) and self.held != 0

    def add(self, segment: Segment, now: float) -> None:
        """Append a segment and plan the queue anew."""
        if segment.length <= _STOP:
            return
        if self.queue:
            segment.junction = self._corner(self.queue[-1], segment)
        else:
            self.since = now
        self.queue.append(segment)
        if self.held is None:
            self._split(now)
            self._plan()

    def next_event(self) -> float | None:
        """Time at which the current segment ends."""
        return self.since + self.queue[0].seconds if self.moving else None

    def trips_at(self) -> float | None:
        """Time at which the current segment closes a limit switch, or None."""
        if not self.moving or self.queue[0].trip is None:
            return None
        after = self.queue[0].reaches(self.queue[0].trip)
        return None if after is None else self.since + after

    def split(self, now: float) -> None:
        """Count what has been moved up to now as finished; the rest goes on at the same speed."""
        if self.moving and now > self.since:
            self._split(now)
            self._plan()

    def advance(self, now: float) -> None:
        """Finish every segment that ends up to ``now``."""
        while self.moving and self.since + self.queue[0].seconds <= now:
            segment = self.queue.popleft()
            end = self.since + segment.seconds
            self.finished.append((self.since, end, segment))
            self.position = segment.point(segment.length)
            self.since = end
            if self.held is not None:
                self.held -= 1

    def state(self, now: float) -> tuple[Vector, float]:
        """Position and speed at ``now``."""
        if not self.moving:
            return self.position, 0.0
        distance, speed = self.queue[0].at(now - self.since)
        return self.queue[0].point(distance), speed

    def override(self, now: float, feed: float, rapid: float) -> None:
        """Feed and rapid overrides: every segment gets its new speed, the one under way brakes or speeds up.

        Args:
            now: time.
            feed: share of the programmed speeds.
            rapid: share of the fastest speeds, for rapids.
        """
        if self.moving:
            self._split(now)
        for segment in self.queue:
            asked = segment.limit * rapid if segment.rapid else segment.programmed * feed
            segment.speed = min(segment.limit, asked)
        if self.held is not None or not self.queue:
            return
        for before, after in itertools.pairwise(self.queue):
            after.junction = self._corner(before, after)
        self._brake()
        self._plan()

    def _brake(self) -> None:
        """Slow the segments under way down to their speeds, as fast as their acceleration allows."""
        speed = self.queue[0].v_in
        braking: list[Segment] = []
        while self.queue and speed > self.queue[0].speed + _STOP:
            segment = self.queue.popleft()
            segment.junction = speed
            need = (speed**2 - segment.speed**2) / (2.0 * segment.accel)
            wanted, segment.speed = segment.speed, speed
            braking.append(segment)
            if need < segment.length - _STOP:
                rest = segment.after(need, wanted)
                rest.speed = wanted
                segment.length = need
                self.queue.appendleft(rest)
                break
            speed = math.sqrt(max(speed**2 - 2.0 * segment.accel * segment.length, 0.0))
            if self.queue:
                self.queue[0].junction = min(self.queue[0].junction, speed)
        self.queue.extendleft(reversed(braking))

    def hold(self, now: float) -> None:
        """Slow down to a stand; the rest of the queue waits."""
        if self.held is not None:
            return
        self.held = 0
        if not self.queue:
            return
        self._split(now)
        speed = self.queue[0].v_in
        braking: list[Segment] = []
        while self.queue and speed > _STOP:
            segment = self.queue.popleft()
            segment.v_in = speed
            need = speed**2 / (2.0 * segment.accel)
            if need < segment.length - _STOP:
                rest = segment.after(need, 0.0)
                segment.length, segment.v_out = need, 0.0
                self.queue.appendleft(rest)
            else:
                segment.v_out = math.sqrt(max(speed**2 - 2.0 * segment.accel * segment.length, 0.0))
            segment.v_top = segment.v_in
            braking.append(segment)
            speed = segment.v_out
        self.queue.extendleft(reversed(braking))
        self.held = len(braking)

    def resume(self, now: float) -> None:
        """Go on after a hold."""
        self.held = None
        self.since = now
        if self.queue:
            self.queue[0].v_in = 0.0
            self._plan()

    def abort(self, now: float) -> None:
        """Stop at once where the machine is and forget the queue (position is what the steps say)."""
        place, _ = self.state(now)
        if self.moving and now > self.since:
            self._split(now)
        self.queue.clear()
        self.position = place
        self.held = None

    def _split(self, now: float) -> None:
        segment = self.queue[0]
        t = now - self.since
        if t <= 0.0:
            return
        distance, speed = segment.at(t)
        rest = segment.after(distance, speed)
        done = Segment(**{**segment.__dict__, "length": distance, "v_out": speed})
        done.v_top = max(min(segment.v_top, max(speed, self._peak(segment, t))), speed)
        self.finished.append((self.since, now, done))
        self.position = rest.start
        self.queue[0] = rest
        self.since = now

    @staticmethod
    def _peak(segment: Segment, t: float) -> float:
        up, _, _ = segment.times()
        return segment.v_top if t >= up else segment.v_in + segment.accel * t

    def _plan(self) -> None:
        queue = self.queue
        allowed = 0.0
        limits: list[float] = []
        for segment in reversed(queue):
            limits.append(allowed)
            entry = math.sqrt(allowed**2 + 2.0 * segment.accel * segment.length)
            allowed = min(segment.junction, entry)
        speed = queue[0].v_in
        for segment, v_out in zip(queue, reversed(limits), strict=True):
            segment.v_in = speed
            segment.v_out = min(v_out, math.sqrt(speed**2 + 2.0 * segment.accel * segment.length))
            segment.shape()
            speed = segment.v_out

    def _corner(self, before: Segment, after: Segment) -> float:
        cosine = -sum(a * b for a, b in zip(before.unit, after.unit, strict=True))
        nominal = min(before.speed, after.speed)
        if cosine > 0.999999:
            return 0.0
        if cosine < -0.999999:
            return nominal
        half = math.sqrt((1.0 - cosine) / 2.0)
        accel = min(before.accel, after.accel)
        return min(nominal, math.sqrt(accel * self.deviation * half / (1.0 - half)))
