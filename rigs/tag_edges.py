"""Corners of a tag to a few hundredths of a pixel: lines through its four edges, from all their points."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

__all__ = ["sharpened_corners"]

Array = NDArray[np.float64]

_ACROSS = 0.45  # of a cell: how far on both sides of an edge is looked
_ENDS = 0.06  # of an edge: left out at both ends, where the other edge is near
_ROUNDS = 3
_LEAST = 8  # points of an edge
_RISE = 10.0  # levels from black to white


def sharpened_corners(picture: NDArray[np.uint8], quad: Array, cells: int) -> Array | None:
    """Corners of the black square of a tag, from the lines along its edges.

    Across each edge the picture goes from black to white; where it passes the mean of both is a point of the
    edge, whatever the blur.

    Args:
        picture: grey.
        quad: (4, 2) corners as detected, within a third of a cell.
        cells: cells along a side of the tag, its border included.

    Returns:
        (4, 2) corners in the same order, or None where an edge is not clear.
    """
    corners = np.asarray(quad, dtype=np.float64)
    smooth = picture.astype(np.float64)
    for _ in range(_ROUNDS):
        centre = corners.mean(axis=0)
        lines = []
        for a, b in itertools.pairwise([*corners, corners[0]]):
            line = _edge(smooth, a, b, centre, cells)
            if line is None:
                return None
            lines.append(line)
        moved = np.array([_meet(lines[k - 1], lines[k]) for k in range(4)])
        if not np.isfinite(moved).all():
            return None
        step, corners = float(np.abs(moved - corners).max()), moved
        if step < 0.01:
            break
    side = np.linalg.norm(np.asarray(quad) - np.roll(quad, -1, axis=0), axis=1).min()
    if np.abs(corners - quad).max() > side / cells:
        return None
    return corners


def _edge(picture: Array, a: Array, b: Array, centre: Array, cells: int) -> tuple[Array, Array] | None:
    """Line (a point, a direction) through an edge of the tag, or None."""
    from scipy.ndimage import map_coordinates

    length = float(np.linalg.norm(b - a))
    if length < 8.0:
        return None
    along = (b - a) / length
    normal = np.array([along[1], -along[0]])
    if (a + b - 2.0 * centre) @ normal < 0.0:
        normal = -normal  # outwards, from black to white
    reach = max(_ACROSS * float(abs((0.5 * (a + b) - centre) @ normal)) * 2.0 / cells, 1.5)
    count = max(int(length * (1.0 - 2.0 * _ENDS)), 12)
    steps = max(int(4.0 * reach), 8)
    t = np.linspace(_ENDS * length, (1.0 - _ENDS) * length, count)
    s = np.linspace(-reach, reach, 2 * steps + 1)
    places = a + t[:, None, None] * along + s[None, :, None] * normal
    values = map_coordinates(picture, [places[..., 1], places[..., 0]], order=1, mode="nearest")
    dark, bright = values[:, :3].mean(axis=1), values[:, -3:].mean(axis=1)
    crossing = _crossing(values, s, 0.5 * (dark + bright))
    rise = bright - dark
    good = (rise > 0.3 * float(np.median(rise))) & (rise > _RISE) & np.isfinite(crossing)
    centred = np.where(good, crossing, 0.0)
    for _ in range(3):
        if good.sum() < _LEAST:
            return None
        line = np.polynomial.polynomial.polyfit(t[good], centred[good], 1)
        off = centred - np.polynomial.polynomial.polyval(t, line)
        spread = 1.4826 * float(np.median(np.abs(off[good]))) + 0.02
        good &= np.abs(off) < 3.0 * spread
    point = a + line[0] * normal
    return point, along + line[1] * normal


def _crossing(values: Array, s: Array, level: Array) -> Array:
    """Where each row rises through its level, next to its middle; NaN where it does not."""
    above = values >= level[:, None]
    rises = ~above[:, :-1] & above[:, 1:]
    found = rises.any(axis=1)
    place = np.where(rises, np.abs(0.5 * (s[1:] + s[:-1]))[None, :], np.inf).argmin(axis=1)
    rows = np.arange(len(values))
    v0, v1 = values[rows, place], values[rows, place + 1]
    share = (level - v0) / np.where(v1 > v0, v1 - v0, 1.0)
    return np.where(found, s[place] + share * (s[1] - s[0]), np.nan)


def _meet(one: tuple[Array, Array], two: tuple[Array, Array]) -> Array:
    """Point where two lines meet."""
    (p, d), (q, e) = one, two
    cross = d[0] * e[1] - d[1] * e[0]
    if abs(cross) < 1e-9:
        return np.full(2, np.nan)
    r = q - p
    out: Array = p + d * ((r[0] * e[1] - r[1] * e[0]) / cross)
    return out
