"""Bounds that prove two convex bodies apart while one of them turns about a line."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["first_reach", "may_meet"]

_DIRECTIONS = 16
_SLACK = 1e-6


def may_meet(
    moving: NDArray[np.float64], rest: NDArray[np.float64], axis: NDArray[np.float64], sweep_rad: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs (i, j) of a moving and a resting body that no cylinder bound keeps apart during the turn.

    Every body lies in a range of heights along the axis, of distances from it and of angles around it; a pair
    for which one of the three ranges is disjoint at every angle of the turn cannot meet.

    Args:
        moving: (M, K, 3) corners of the moving bodies before the turn, relative to a point of the axis.
        rest: (R, L, 3) corners of the resting bodies, likewise.
        axis: (3,) unit vector; the turn is right-handed about it.
        sweep_rad: angle of the turn, positive.
    """
    first, second = _frame(axis)
    a, b = (_ranges(body, axis, first, second) for body in (moving, rest))
    near = (a.low[:, None] <= b.high + _SLACK) & (b.low <= a.high[:, None] + _SLACK)
    near &= (a.inner[:, None] <= b.outer + _SLACK) & (b.inner <= a.outer[:, None] + _SLACK)
    i, j = np.nonzero(near)
    # The moving body's sector grows by the turn at its leading end: do two arcs of the circle overlap?
    gap_after = np.mod(b.start[j] - a.start[i], 2.0 * np.pi)
    gap_before = np.mod(a.start[i] - b.start[j], 2.0 * np.pi)
    overlap = (gap_after <= a.arc[i] + sweep_rad + _SLACK) | (gap_before <= b.arc[j] + _SLACK)
    overlap |= (gap_after >= 2.0 * np.pi - _SLACK) | (gap_before >= 2.0 * np.pi - _SLACK)
    return i[overlap], j[overlap]


def first_reach(
    moving: NDArray[np.float64],
    rest: NDArray[np.float64],
    axis: NDArray[np.float64],
    at_rad: NDArray[np.float64],
    normal: NDArray[np.float64],
    sweep_rad: float,
) -> NDArray[np.float64]:
    """(N,) further angle for which the plane across ``normal`` is certain to keep each pair apart.

    With n fixed, a corner v of the moving body has n·R(d)v = C + A cos d + B sin d; the plane holds until the
    first d at which that reaches the nearest corner of the resting body. Source: elementary; compare
    the separating-plane step of conservative advancement (Mirtich, 1996).

    Args:
        moving: (N, K, 3) corners before the turn, relative to a point of the axis.
        rest: (N, L, 3) corners of the resting bodies.
        axis: (3,) unit vector of the turn.
        at_rad: (N,) angle of the turn that the bodies have reached.
        normal: (N, 3) unit vectors from the moving to the resting body; zero where there is no plane.
        sweep_rad: angle of the whole turn; a plane that holds to the end gives at least the rest of it.
    """
    cos, sin = np.cos(at_rad)[:, None, None], np.sin(at_rad)[:, None, None]
    along = (moving @ axis)[..., None] * axis
    across = moving - along
    side = np.cross(axis, moving)
    here = along + cos * across + sin * side
    limit = np.einsum("nkd,nd->nk", rest, normal).min(axis=1)
    across_here = here - along
    a = np.einsum("nkd,nd->nk", across_here, normal)
    b = np.einsum("nkd,nd->nk", np.cross(axis, across_here), normal)
    c = np.einsum("nkd,nd->nk", along, normal)
    room = limit[:, None] - c
    size = np.hypot(a, b)
    free = room >= size
    ratio = np.clip(room / np.maximum(size, 1e-300), -1.0, 1.0)
    angle = np.mod(np.arctan2(b, a) - np.arccos(ratio), 2.0 * np.pi)
    angle = np.where(free, np.inf, np.where(a >= room, 0.0, angle))
    step: NDArray[np.float64] = angle.min(axis=1)
    step = np.where(np.any(normal != 0.0, axis=1), step, 0.0)
    return np.minimum(step, sweep_rad)


class _Ranges:
    """Height, distance and angle of bodies about an axis."""

    def __init__(
        self, low: NDArray[np.float64], high: NDArray[np.float64], inner: NDArray[np.float64],
        outer: NDArray[np.float64], start: NDArray[np.float64], arc: NDArray[np.float64],
    ) -> None:  # fmt: skip
        self.low, self.high, self.inner, self.outer = low, high, inner, outer
        self.start, self.arc = start, arc


def _ranges(
    corners: NDArray[np.float64],
    axis: NDArray[np.float64],
    first: NDArray[np.float64],
    second: NDArray[np.float64],
) -> _Ranges:
    height = corners @ axis
    x, y = corners @ first, corners @ second
    radius = np.hypot(x, y)
    around = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False)
    # A convex body is as far from the axis as any half plane that holds all of its corners.
    inner = np.max([np.min(np.cos(d) * x + np.sin(d) * y, axis=1) for d in around], axis=0, initial=0.0)
    angle = np.sort(np.mod(np.arctan2(y, x), 2.0 * np.pi), axis=1)
    gaps = np.diff(np.concatenate([angle, angle[:, :1] + 2.0 * np.pi], axis=1), axis=1)
    widest = np.argmax(gaps, axis=1)
    rows = np.arange(len(corners))
    start = angle[rows, (widest + 1) % angle.shape[1]]
    arc = 2.0 * np.pi - gaps[rows, widest]
    round_axis = inner <= 0.0  # the axis may run through the body: every angle
    return _Ranges(
        height.min(axis=1), height.max(axis=1), inner, radius.max(axis=1),
        np.where(round_axis, 0.0, start), np.where(round_axis, 2.0 * np.pi, arc),
    )  # fmt: skip


def _frame(axis: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Two unit vectors that make a right-handed frame with ``axis``."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(axis, helper)
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)
