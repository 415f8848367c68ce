"""The flat metal as a conforming triangle mesh for the flow of heat: net, sheet and the tabs between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Clip, FoldPlan
from planner.net import Net
from planner.values import frozen_array

__all__ = ["ThermalMesh", "crease_line", "net_mesh", "plan_mesh", "refined"]


@dataclass(frozen=True, eq=False)
class ThermalMesh:
    """Triangles that conduct heat, and where they are tied to one another or clamped.

    Attributes:
        vertices: (V, 2) places in mm. Both sides of a cut have vertices of their own: no heat crosses it.
        triangles: (T, 3) indices into ``vertices``.
        links: (L, 2) pairs of vertices that metal bridges over the kerf: the tabs.
        link_ratio: (L,) width of the bridge over its length.
        clamped: (V,) True where a clamp holds the metal at the temperature of the room.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    links: NDArray[np.int64]
    link_ratio: NDArray[np.float64]
    clamped: NDArray[np.bool_]

    def __post_init__(self) -> None:
        """Freeze the arrays and check their shapes."""
        for name, dtype, shape in (
            ("vertices", np.float64, (None, 2)),
            ("triangles", np.int64, (None, 3)),
            ("links", np.int64, (None, 2)),
            ("link_ratio", np.float64, (len(self.links),)),
            ("clamped", np.bool_, (len(self.vertices),)),
        ):
            object.__setattr__(self, name, frozen_array(getattr(self, name), dtype, shape))


def net_mesh(net: Net, longest_mm: float) -> ThermalMesh:
    """The net alone, no triangle side longer than ``longest_mm``; its outline is insulated.

    Raises:
        ValueError: if ``longest_mm`` is not above zero.
    """
    vertices, triangles = refined(net.vertices, net.faces, longest_mm)
    return ThermalMesh(
        vertices, triangles, np.zeros((0, 2), np.int64), np.zeros(0), np.zeros(len(vertices), np.bool_)
    )


def plan_mesh(plan: FoldPlan, longest_mm: float, sheet_mm: float | None = None) -> ThermalMesh:
    """The net, the sheet that no step clips, and the tabs; the frame is clamped.

    The metal is taken as it is while creases are folded: everything is cut that is ever cut but the tabs.

    Args:
        plan: the plan.
        longest_mm: longest triangle side in the net.
        sheet_mm: the same in the sheet; four times ``longest_mm`` when None.

    Raises:
        ValueError: if a length is not above zero.
    """
    net, sheet = plan.net, plan.sheet
    coarse = 4.0 * longest_mm if sheet_mm is None else sheet_mm
    inner, faces = refined(net.vertices, net.faces, longest_mm)
    clipped = {face for step in plan.steps if isinstance(step, Clip) for face in step.faces}
    kept = np.array([t for t in range(len(sheet.faces)) if t not in clipped], dtype=np.int64)
    corners, around, frame = _own_vertices(sheet.vertices, sheet.faces[kept], sheet.frame_faces[kept])
    outer, metal = refined(corners, around, coarse)
    fixed = _inside(outer, corners, around[frame])
    links, width = _tab_links(plan, inner, outer)
    return ThermalMesh(
        vertices=np.concatenate([inner, outer]),
        triangles=np.concatenate([faces, metal + len(inner)]),
        links=links + np.array([0, len(inner)]),
        link_ratio=width,
        clamped=np.concatenate([np.zeros(len(inner), np.bool_), fixed]),
    )


def refined(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], longest_mm: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Bisect triangles until no side is longer than ``longest_mm``; the mesh stays conforming.

    The longest side of a triangle is always halved first, so that no angle falls below half of the
    smallest one of the start. Source: Rivara, Int. J. Numer. Meth. Eng. 20 (1984) 745.

    Args:
        vertices: (V, 2) mm; the given ones stay first and unchanged.
        triangles: (T, 3).
        longest_mm: longest side.

    Raises:
        ValueError: if ``longest_mm`` is not above zero.
    """
    if not longest_mm > 0.0:
        raise ValueError(f"longest side {longest_mm:g} mm of a triangle: expected a length above 0")
    points, cells = np.array(vertices, dtype=np.float64), np.array(triangles, dtype=np.int64)
    while len(cells):
        ends = np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2)
        sides, index = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
        of_cell = index.reshape(-1, 3)
        length = np.linalg.norm(points[sides[:, 0]] - points[sides[:, 1]], axis=1)
        # ties are broken by the number of the side, alike in both triangles
        rank = np.empty(len(sides), dtype=np.int64)
        rank[np.lexsort((np.arange(len(sides)), length))] = np.arange(len(sides))
        first = np.argmax(rank[of_cell], axis=1)
        longest = of_cell[np.arange(len(cells)), first]
        marked = length > longest_mm * (1.0 + 1e-12)
        if not marked.any():
            break
        while True:
            touched = marked[of_cell].any(axis=1)
            before = int(marked.sum())
            marked[longest[touched]] = True
            if int(marked.sum()) == before:
                break
        middle = np.full(len(sides), -1, dtype=np.int64)
        middle[marked] = len(points) + np.arange(int(marked.sum()))
        points = np.concatenate([points, points[sides[marked]].mean(axis=1)])
        cells = _bisected(cells, middle[of_cell], first)
    return points, cells


def crease_line(
    mesh: ThermalMesh, start: NDArray[np.float64], end: NDArray[np.float64], among: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Vertices on a segment with their shares of its length (they sum to 1), by the trapezoidal rule.

    Args:
        mesh: the mesh.
        start: (2,) one end, mm.
        end: (2,) the other.
        among: only the first so many vertices count: those of the net.

    Raises:
        ValueError: if fewer than two vertices lie on the segment.
    """
    span = end - start
    length = float(np.linalg.norm(span))
    offset = mesh.vertices[:among] - start
    along = offset @ span / length
    across = np.abs(offset[:, 0] * span[1] - offset[:, 1] * span[0]) / length
    slack = 1e-6 * max(length, 1.0)
    on = np.flatnonzero((across < slack) & (along > -slack) & (along < length + slack))
    on = on[np.argsort(along[on], kind="stable")]
    place = along[on]
    if len(on) < 2:
        raise ValueError(f"no triangle side lies on the line from {start.tolist()} to {end.tolist()}")
    weight = np.zeros(len(on))
    gap = np.diff(place)
    weight[:-1] += 0.5 * gap
    weight[1:] += 0.5 * gap
    return on, weight / weight.sum()


def _bisected(
    cells: NDArray[np.int64], middle: NDArray[np.int64], first: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Split every triangle at its marked sides, the longest first."""
    rows = np.arange(len(cells))
    turn = (first[:, None] + np.arange(3)) % 3
    a, b, c = cells[rows[:, None], turn].T
    ab, bc, ca = middle[rows[:, None], turn].T
    whole = ab < 0
    out = [np.stack([a, b, c], axis=1)[whole]]
    # halves (a, ab, c) and (ab, b, c), each split once more where its outer side is marked
    split = ~whole
    left, right = split & (ca >= 0), split & (bc >= 0)
    only_left, only_right = split & (ca < 0), split & (bc < 0)
    out += [
        np.stack([a, ab, c], axis=1)[only_left],
        np.stack([a, ab, ca], axis=1)[left],
        np.stack([ca, ab, c], axis=1)[left],
        np.stack([ab, b, c], axis=1)[only_right],
        np.stack([ab, b, bc], axis=1)[right],
        np.stack([ab, bc, c], axis=1)[right],
    ]
    return np.concatenate(out)


def _own_vertices(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], frame: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.bool_]]:
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], faces.reshape(-1, 3), frame


def _inside(
    points: NDArray[np.float64], corners: NDArray[np.float64], triangles: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(V,) True for points in or on one of ``triangles``."""
    found = np.zeros(len(points), dtype=np.bool_)
    for a, b, c in corners[triangles]:
        twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if abs(twice) < 1e-12:
            continue
        d = points - a
        s = (d[:, 0] * (c[1] - a[1]) - d[:, 1] * (c[0] - a[0])) / twice
        t = ((b[0] - a[0]) * d[:, 1] - (b[1] - a[1]) * d[:, 0]) / twice
        found |= (s > -1e-6) & (t > -1e-6) & (s + t < 1.0 + 1e-6)
    return found


def _tab_links(
    plan: FoldPlan, inner: NDArray[np.float64], outer: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Bridges of the tabs: vertices of the net nearest to each stretch, each to the nearest of the sheet."""
    links: list[tuple[int, int]] = []
    width: list[float] = []
    if not len(outer):
        return np.zeros((0, 2), np.int64), np.zeros(0)
    for tab in plan.sheet.tabs:
        start, end = np.array(tab.start), np.array(tab.end)
        wide = float(np.linalg.norm(end - start))
        places = start + np.linspace(0.1, 0.9, 5)[:, None] * (end - start)
        for place in places:
            near = int(np.argmin(np.linalg.norm(inner - place, axis=1)))
            far = int(np.argmin(np.linalg.norm(outer - place, axis=1)))
            gap = max(float(np.linalg.norm(outer[far] - place)), plan.limits.kerf, 1e-3)
            links.append((near, far))
            width.append(wide / len(places) / gap)
    return np.array(links, dtype=np.int64).reshape(-1, 2), np.array(width)
