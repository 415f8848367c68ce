"""Draws the shipped goal shapes: ``python docs/make_pictures.py`` writes docs/pictures/goals.png.

A small painter with a depth buffer: the pictures need no graphics library and are the same everywhere.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from models.goals import goal_names, goal_path

TILE, OVERSAMPLING, COLUMNS = 300, 3, 4
PAPER, EDGE = np.array([250.0, 250.0, 248.0]), np.array([40.0, 48.0, 60.0])
OUTSIDE, INSIDE = np.array([120.0, 165.0, 205.0]), np.array([225.0, 170.0, 110.0])


def read_obj(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (V, 3) and triangles (F, 3) of a plain OBJ file."""
    rows = [line.split() for line in path.read_text().splitlines()]
    vertices = [[float(x) for x in row[1:4]] for row in rows if row and row[0] == "v"]
    faces = [[int(x) - 1 for x in row[1:4]] for row in rows if row and row[0] == "f"]
    return np.array(vertices), np.array(faces, dtype=np.int64)


def camera(turn_deg: float = -35.0, tilt_deg: float = 28.0) -> NDArray[np.float64]:
    """(3, 3) rotation to picture axes: right, up, towards the viewer."""
    a, b = np.radians(turn_deg), np.radians(tilt_deg)
    turn = np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
    view = np.array([[1.0, 0.0, 0.0], [0.0, np.sin(b), np.cos(b)], [0.0, -np.cos(b), np.sin(b)]])
    return view @ turn


def draw(vertices: NDArray[np.float64], faces: NDArray[np.int64], size: int) -> NDArray[np.float64]:
    """(size, size, 3) picture of a mesh, outer side blue, inner side orange, edges dark."""
    points = vertices @ camera().T
    low, high = points.min(axis=0), points.max(axis=0)
    scale = 0.86 * size / float((high - low)[:2].max())
    points = (points - (low + high) / 2) * scale
    points[:, :2] = points[:, :2] * [1.0, -1.0] + size / 2
    picture = np.tile(PAPER, (size, size, 1))
    depth = np.full((size, size), -np.inf)
    light = np.array([-0.3, 0.6, 0.74])
    for corners in points[faces]:
        paint_triangle(picture, depth, corners, light)
    edges = {tuple(sorted((int(f[k]), int(f[(k + 1) % 3])))) for f in faces for k in range(3)}
    for a, b in sorted(edges):
        paint_edge(picture, depth, points[a], points[b])
    return picture


def paint_triangle(
    picture: NDArray[np.float64],
    depth: NDArray[np.float64],
    corners: NDArray[np.float64],
    light: NDArray[np.float64],
) -> None:
    """Paint one triangle (3, 3), corners in pixels with y down, into the picture where it is nearest."""
    size = len(depth)
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0]) * [-1.0, 1.0, -1.0]
    area = normal[2]
    if abs(area) < 1e-9:
        return
    normal = normal / np.linalg.norm(normal)
    shade = 0.45 + 0.55 * abs(float(normal @ light))
    colour = shade * (OUTSIDE if area > 0 else INSIDE)
    x0, y0 = np.clip(np.floor(corners[:, :2].min(axis=0)).astype(int), 0, size - 1)
    x1, y1 = np.clip(np.ceil(corners[:, :2].max(axis=0)).astype(int), 0, size - 1)
    ys, xs = np.mgrid[y0 : y1 + 1, x0 : x1 + 1] + 0.5
    a, b, c = corners
    whole = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    wb = ((xs - a[0]) * (c[1] - a[1]) - (ys - a[1]) * (c[0] - a[0])) / whole
    wc = ((b[0] - a[0]) * (ys - a[1]) - (b[1] - a[1]) * (xs - a[0])) / whole
    near = (1.0 - wb - wc) * a[2] + wb * b[2] + wc * c[2]
    here = depth[y0 : y1 + 1, x0 : x1 + 1]
    mask = (wb >= 0) & (wc >= 0) & (wb + wc <= 1) & (near > here)
    here[mask] = near[mask]
    picture[y0 : y1 + 1, x0 : x1 + 1][mask] = colour


def paint_edge(
    picture: NDArray[np.float64],
    depth: NDArray[np.float64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
) -> None:
    """Paint one edge where nothing stands clearly before it."""
    size, radius = len(depth), OVERSAMPLING // 2
    count = int(np.abs(end - start)[:2].max()) * 2 + 2
    line = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
    for dx in range(-radius, radius + 1):
        for dy in range(-radius, radius + 1):
            x = np.clip(np.floor(line[:, 0]).astype(int) + dx, 0, size - 1)
            y = np.clip(np.floor(line[:, 1]).astype(int) + dy, 0, size - 1)
            seen = line[:, 2] >= depth[y, x] - 6.0
            picture[y[seen], x[seen]] = EDGE


def write_png(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture (height, width, 3)."""
    height, width, _ = picture.shape
    rows = b"".join(b"\0" + row.tobytes() for row in picture)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(rows, 9))
        + chunk(b"IEND", b"")
    )


def contact_sheet() -> NDArray[np.uint8]:
    """All shipped goal shapes in rows, in the order of their names."""
    names = goal_names()
    rows = -(-len(names) // COLUMNS)
    sheet = np.tile(PAPER, (rows * TILE, COLUMNS * TILE, 1))
    for number, name in enumerate(names):
        big = draw(*read_obj(goal_path(name)), TILE * OVERSAMPLING)
        tile = big.reshape(TILE, OVERSAMPLING, TILE, OVERSAMPLING, 3).mean(axis=(1, 3))
        row, column = divmod(number, COLUMNS)
        sheet[row * TILE : (row + 1) * TILE, column * TILE : (column + 1) * TILE] = tile
    return sheet.round().clip(0, 255).astype(np.uint8)


if __name__ == "__main__":
    write_png(Path(__file__).parent / "pictures" / "goals.png", contact_sheet())
