"""Where tags lie on a net: places for them, and which tags stand on the two sides of a crease."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.net import Net
from rigs.errors import JobError
from rigs.hinge_fit import Hinge

__all__ = ["Tag", "hinge_of", "tags_for"]

QUIET_CELLS = 1
"""Width of the white frame that a tag needs around it, in cells."""

_CELLS = {"16h5": 6, "25h9": 7, "36h10": 8, "36h11": 8}


@dataclass(frozen=True)
class Tag:
    """A tag on a face.

    Attributes:
        number: of the tag in its family.
        face: net face that carries it.
        centre_mm: in the flat sheet.
        size_mm: side of its black square.
        turned_deg: how its top is turned from +y, anticlockwise seen from the side that it is on.
        side: ``top`` is +z of the flat sheet.
    """

    number: int
    face: int
    centre_mm: tuple[float, float]
    size_mm: float
    turned_deg: float = 0.0
    side: Literal["top", "bottom"] = "top"

    @property
    def corners_mm(self) -> NDArray[np.float64]:
        """(4, 2) corners in the flat, from the tag's own top left clockwise as seen from its side."""
        h = 0.5 * self.size_mm
        own = np.array([(-h, h), (h, h), (h, -h), (-h, -h)])
        cos, sin = math.cos(math.radians(self.turned_deg)), math.sin(math.radians(self.turned_deg))
        own = own @ np.array([(cos, sin), (-sin, cos)])
        if self.side == "bottom":
            own[:, 0] *= -1.0
        placed: NDArray[np.float64] = own + np.asarray(self.centre_mm)
        return placed


def hinge_of(net: Net, crease: int, tags: Sequence[Tag]) -> Hinge:
    """A crease with the tags on its two faces and on what is joined to these by flat joints.

    Raises:
        JobError: if it is no crease of the net.
    """
    face = net.child_of.get(crease)
    if face is None or net.assignment[crease] not in ("V", "M"):
        raise JobError(f"edge {crease} is no crease of this net")
    panels = _panels(net)
    start, end = net.hinge(face)
    fixed, turning = (
        {t.number: t.corners_mm for t in tags if panels[t.face] == panels[side]}
        for side in (int(net.parent[face]), face)
    )
    return Hinge(np.asarray(start), np.asarray(end), fixed, turning)


def tags_for(
    net: Net, *, family: str = "36h11", side: Literal["top", "bottom"] = "top", least_mm: float = 1.0
) -> tuple[Tag, ...]:
    """A tag for every panel that has room for one: on its face with the largest inscribed circle.

    Args:
        net: the net.
        family: of the tags; a smaller family has larger cells.
        side: on which they are put.
        least_mm: smaller tags are left out.
    """
    panels = _panels(net)
    cells = _CELLS[family]
    best: dict[int, Tag] = {}
    for face, corners in enumerate(net.vertices[net.faces]):
        a, b, c = corners
        sides = np.array([math.dist(b, c), math.dist(c, a), math.dist(a, b)])
        around = float(sides.sum())
        centre = sides @ corners / around
        area = 0.5 * abs(float((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]))
        size = 2.0 * area / around * math.sqrt(2.0) * cells / (cells + 2 * QUIET_CELLS)
        panel = int(panels[face])
        if size >= least_mm and (panel not in best or size > best[panel].size_mm):
            x, y = (round(float(v), 3) for v in centre)
            best[panel] = Tag(face, face, (x, y), round(size - 0.0005, 3), 0.0, side)
    return tuple(sorted(best.values(), key=lambda t: t.number))


def _panels(net: Net) -> NDArray[np.int64]:
    """(F,) number of the rigid panel of every face: faces joined by flat joints move as one."""
    panel = np.arange(len(net.faces))
    for face in net.order[1:].tolist():
        if net.assignment[net.crease_of[face]] == "F":
            panel[face] = panel[net.parent[face]]
    return panel
