"""Shapes that close around a middle: a star and a tube wound like a snail's shell. Sizes in mm."""

from __future__ import annotations

import numpy as np

from models.goals.folded_panels import Mesh

__all__ = ["snail_tube", "star"]


def star(points: int = 5) -> Mesh:
    """A raised star with a flared rim, open below."""
    count = 2 * points
    angle = np.arange(count) * np.pi / points
    radius = np.where(np.arange(count) % 2 == 0, 30.0, 15.0)
    outline = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)])
    rim = outline * 1.4 - [0.0, 0.0, 5.0]
    vertices = np.vstack([outline, rim, [[0.0, 0.0, 9.0]]])
    faces = []
    for k in range(count):
        j = (k + 1) % count
        faces.append((k, j, 2 * count))
        if np.sum((vertices[k] - vertices[count + j]) ** 2) < np.sum(
            (vertices[j] - vertices[count + k]) ** 2
        ):
            faces += [(k, count + k, count + j), (k, count + j, j)]
        else:
            faces += [(k, count + k, j), (j, count + k, count + j)]
    return vertices, np.array(faces, dtype=np.int64)


def snail_tube(sides: int = 5, segments: int = 12) -> Mesh:
    """A tube along a logarithmic spiral that narrows to a tip; the wide end is open.

    One turn shrinks the spiral to 0.33 of its size; the tube's radius is 0.38 of the spiral's, so
    neighbouring turns keep apart (1 - 0.33 > 0.38 * (1 + 0.33)).
    """
    turns, shrink, thickness, climb = 1.4, 0.33, 0.38, 14.0
    along = np.linspace(0.0, 1.0, segments + 1)
    heading = 2.0 * np.pi * turns * along
    size = 30.0 * shrink ** (turns * along)
    direction = np.column_stack([np.cos(heading), np.sin(heading), np.zeros(segments + 1)])
    centre = size[:, None] * direction
    centre[:, 2] = climb * along
    around = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    offset = np.cos(around)[None, :, None] * direction[:, None, :]
    offset = offset + np.sin(around)[None, :, None] * np.array([0.0, 0.0, 1.0])
    rings = centre[:, None, :] + thickness * size[:, None, None] * offset
    tip_heading = 2.0 * np.pi * turns * (1.0 + 1.2 / segments)
    tip_size = 30.0 * shrink ** (turns * (1.0 + 1.2 / segments))
    tip = [tip_size * np.cos(tip_heading), tip_size * np.sin(tip_heading), climb * (1.0 + 1.2 / segments)]
    vertices = np.vstack([rings.reshape(-1, 3), [tip]])
    faces = []
    for ring in range(segments):
        for k in range(sides):
            a, b = ring * sides + k, ring * sides + (k + 1) % sides
            c, d = a + sides, b + sides
            if np.sum((vertices[a] - vertices[d]) ** 2) < np.sum((vertices[b] - vertices[c]) ** 2):
                faces += [(a, d, b), (a, c, d)]
            else:
                faces += [(a, c, b), (b, c, d)]
    last = segments * sides
    faces += [(last + k, len(vertices) - 1, last + (k + 1) % sides) for k in range(sides)]
    return vertices, np.array(faces, dtype=np.int64)
