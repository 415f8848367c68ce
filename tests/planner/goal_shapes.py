"""Goals for the tests of nets: bodies with known properties, random bodies, and meshes from files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from planner.goal_mesh import GoalMesh


def hull_goal(points: np.ndarray, name: str = "hull") -> GoalMesh:
    """Convex hull of points (N, 3), wound outwards, unused points dropped."""
    hull = ConvexHull(points)
    centre = points[hull.vertices].mean(axis=0)
    faces = []
    for a, b, c in hull.simplices.tolist():
        outwards = np.cross(points[b] - points[a], points[c] - points[a]) @ (points[a] - centre)
        faces.append([a, b, c] if outwards > 0 else [a, c, b])
    used, compact = np.unique(faces, return_inverse=True)
    return GoalMesh(points[used], compact.reshape(-1, 3), name=name)


def random_hull(count: int, seed: int, size: float = 30.0) -> GoalMesh:
    """Hull of ``count`` random points on a sphere."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return hull_goal(size * points / np.linalg.norm(points, axis=1, keepdims=True))


def even_ball(count: int, size: float = 30.0) -> GoalMesh:
    """Hull of ``count`` points spread evenly over a sphere (golden angle spiral)."""
    height = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    ring = np.sqrt(1.0 - height**2)
    return hull_goal(size * np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1), "ball")


def rough_ball(count: int, seed: int, depth: float = 0.5, size: float = 30.0) -> GoalMesh:
    """A star-shaped body that is not convex: a random hull with its vertices at random distances."""
    ball = random_hull(count, seed, size)
    radius = 1.0 - depth * np.random.default_rng(seed + 1).random(len(ball.vertices))
    return GoalMesh(ball.vertices * radius[:, None], ball.faces, name=f"rough{count}-{seed}")


def torus(around: int = 10, across: int = 5, large: float = 25.0, small: float = 9.0) -> GoalMesh:
    """A closed body of genus 1."""
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    u, v = 2 * np.pi * i / around, 2 * np.pi * j / across
    ring = large + small * np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), small * np.sin(v)], axis=-1).reshape(-1, 3)
    faces = []
    for a in range(around):
        for b in range(across):
            p, q = a * across + b, (a + 1) % around * across + b
            r, s = (a + 1) % around * across + (b + 1) % across, a * across + (b + 1) % across
            faces += [[p, q, r], [p, r, s]]
    return GoalMesh(points, np.array(faces), name="torus")


def block_with_hole(outer: float = 30.0, inner: float = 8.0, height: float = 30.0) -> GoalMesh:
    """A square block with a square through hole whose walls are larger than the hole: flat rings, genus 1."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    flat = np.concatenate([corners * outer / 2, corners * inner / 2])
    points = np.concatenate([np.c_[flat, np.zeros(8)], np.c_[flat, np.full(8, height)]])
    faces = []
    for k in range(4):
        n = (k + 1) % 4
        top, bottom = [8 + k, 8 + n, 12 + n, 12 + k], [k, 4 + k, 4 + n, n]
        outside, inside = [k, n, 8 + n, 8 + k], [4 + n, 4 + k, 12 + k, 12 + n]
        for a, b, c, d in (top, bottom, outside, inside):
            faces += [[a, b, c], [a, c, d]]
    return GoalMesh(points, np.array(faces), name="block with hole")


def plate(nx: int = 4, ny: int = 3, cell: float = 5.0) -> GoalMesh:
    """A flat open plate: one panel with cycles of coplanar faces."""
    points = np.array([[x * cell, y * cell, 0.0] for y in range(ny + 1) for x in range(nx + 1)])
    faces = []
    for y in range(ny):
        for x in range(nx):
            a = y * (nx + 1) + x
            faces += [[a, a + 1, a + nx + 2], [a, a + nx + 2, a + nx + 1]]
    return GoalMesh(points, np.array(faces), name="plate")


def helix_strip(turns: float = 1.6, steps: int = 30, radius: float = 10.0, width: float = 6.0) -> GoalMesh:
    """A strip of triangles whose only flat pattern is a ring that overlaps itself: a cone band."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, steps + 1)
    low = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.02 * angle], axis=1)
    high = low * [1.0 - width / radius, 1.0 - width / radius, 1.0] + [0.0, 0.0, 1.0]
    points = np.concatenate([low, high])
    faces = []
    for k in range(steps):
        a, b, c, d = k, k + 1, steps + 2 + k, steps + 1 + k
        faces += [[a, b, c], [a, c, d]]
    return GoalMesh(points, np.array(faces), name="helix strip")


def tetrahedron(size: float = 20.0) -> GoalMesh:
    """The regular tetrahedron."""
    points = size * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], float) / np.sqrt(8.0)
    return hull_goal(points, "tetrahedron")


def load_obj(path: Path) -> GoalMesh:
    """A clean OBJ file as it stands, polygons split as fans."""
    vertices, faces = [], []
    for line in path.read_text(encoding="utf-8").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            corner = [int(word.split("/")[0]) - 1 for word in words[1:]]
            faces += [[corner[0], corner[k], corner[k + 1]] for k in range(1, len(corner) - 1)]
    return GoalMesh(np.array(vertices), np.array(faces), name=path.stem)


bodies = st.one_of(
    st.builds(random_hull, st.integers(6, 40), st.integers(0, 10_000)),
    st.builds(rough_ball, st.integers(8, 60), st.integers(0, 10_000), st.floats(0.05, 0.7)),
)
"""Closed bodies, convex and not."""
