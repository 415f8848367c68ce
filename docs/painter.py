"""Paints triangles with a depth buffer: the pictures of the documents need no graphics library."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

OVERSAMPLING = 3
PAPER, EDGE = np.array([250.0, 250.0, 248.0]), np.array([40.0, 48.0, 60.0])
OUTSIDE, INSIDE = np.array([120.0, 165.0, 205.0]), np.array([225.0, 170.0, 110.0])
SHEET = np.array([214.0, 214.0, 208.0])
LIGHT = np.array([-0.3, 0.6, 0.74])


class Painting:
    """A picture of (height, width) pixels on which triangles are painted, nearest in front.

    Points are given in pixels times oversampling, y down, z towards the viewer.
    """

    def __init__(self, height: int, width: int) -> None:
        self._picture = np.tile(PAPER, (height * OVERSAMPLING, width * OVERSAMPLING, 1))
        self._depth = np.full(self._picture.shape[:2], -np.inf)

    def triangle(
        self, corners: NDArray[np.float64], outside: NDArray[np.float64], inside: NDArray[np.float64]
    ) -> None:
        """Paint one triangle (3, 3), counter-clockwise seen from outside, in the colour of the side seen."""
        height, width = self._depth.shape
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0]) * [-1.0, 1.0, -1.0]
        area = normal[2]
        if abs(area) < 1e-9:
            return
        shade = 0.45 + 0.55 * abs(float(normal @ LIGHT)) / float(np.linalg.norm(normal))
        x0, y0 = np.clip(np.floor(corners[:, :2].min(axis=0)).astype(int), 0, [width - 1, height - 1])
        x1, y1 = np.clip(np.ceil(corners[:, :2].max(axis=0)).astype(int), 0, [width - 1, height - 1])
        ys, xs = np.mgrid[y0 : y1 + 1, x0 : x1 + 1] + 0.5
        a, b, c = corners
        whole = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        wb = ((xs - a[0]) * (c[1] - a[1]) - (ys - a[1]) * (c[0] - a[0])) / whole
        wc = ((b[0] - a[0]) * (ys - a[1]) - (b[1] - a[1]) * (xs - a[0])) / whole
        near = (1.0 - wb - wc) * a[2] + wb * b[2] + wc * c[2]
        here = self._depth[y0 : y1 + 1, x0 : x1 + 1]
        mask = (wb >= 0) & (wc >= 0) & (wb + wc <= 1) & (near > here)
        here[mask] = near[mask]
        self._picture[y0 : y1 + 1, x0 : x1 + 1][mask] = shade * (outside if area > 0 else inside)

    def line(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> None:
        """Paint a line where nothing stands clearly before it."""
        height, width = self._depth.shape
        radius = OVERSAMPLING // 2
        count = int(np.abs(end - start)[:2].max()) * 2 + 2
        points = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
        for dx in range(-radius, radius + 1):
            for dy in range(-radius, radius + 1):
                x = np.clip(np.floor(points[:, 0]).astype(int) + dx, 0, width - 1)
                y = np.clip(np.floor(points[:, 1]).astype(int) + dy, 0, height - 1)
                seen = points[:, 2] >= self._depth[y, x] - 2.0 * OVERSAMPLING
                self._picture[y[seen], x[seen]] = EDGE

    def pixels(self) -> NDArray[np.uint8]:
        """(height, width, 3) the finished picture."""
        height, width, _ = self._picture.shape
        shape = (height // OVERSAMPLING, OVERSAMPLING, width // OVERSAMPLING, OVERSAMPLING, 3)
        return self._picture.reshape(shape).mean(axis=(1, 3)).round().clip(0, 255).astype(np.uint8)


def camera(turn_deg: float = -35.0, tilt_deg: float = 28.0) -> NDArray[np.float64]:
    """(3, 3) rotation to picture axes: right, up, towards the viewer."""
    a, b = np.radians(turn_deg), np.radians(tilt_deg)
    turn = np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
    view = np.array([[1.0, 0.0, 0.0], [0.0, np.sin(b), np.cos(b)], [0.0, -np.cos(b), np.sin(b)]])
    return view @ turn


def projection(
    points: NDArray[np.float64], view: NDArray[np.float64], height: int, width: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(3, 3) matrix and (3,) offset that fit ``points`` (N, 3) into a picture of height x width."""
    seen = points @ view.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = 0.88 * OVERSAMPLING * np.array([width, height])
    scale = float((room / (high - low)[:2]).min())
    flip = np.diag([scale, -scale, scale])
    middle = np.array([width * OVERSAMPLING / 2, height * OVERSAMPLING / 2, 0.0])
    return flip @ view, middle - flip @ ((low + high) / 2)


def write_png(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture (height, width, 3) of bytes."""
    height, width, _ = picture.shape
    rows = b"".join(b"\0" + row.tobytes() for row in picture)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = [chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows, 9)), chunk(b"IEND", b"")]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
