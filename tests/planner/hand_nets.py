"""Small goals and nets made by plain reference code: a goal and a spanning tree give a net."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.goal_mesh import GoalMesh
from planner.net import FLAT_FOLD_RAD, Net


def neighbours(goal: GoalMesh) -> dict[tuple[int, int], tuple[int, int]]:
    """Directed goal edge → (face, corner where it starts)."""
    return {
        (face[k], face[(k + 1) % 3]): (f, k) for f, face in enumerate(goal.faces.tolist()) for k in range(3)
    }


def signed_dihedral(goal: GoalMesh, face: int, other: int, k: int) -> float:
    """Fold angle across side k of ``face`` in rad, positive = valley seen from outside."""
    corners = goal.vertices[goal.faces[face]]
    along = corners[(k + 1) % 3] - corners[k]
    along /= np.linalg.norm(along)
    n, m = goal.face_normals[face], goal.face_normals[other]
    return -float(np.arctan2(np.cross(n, m) @ along, n @ m))


def net_from_parents(goal: GoalMesh, parent: Sequence[int]) -> Net:
    """Lay ``goal`` flat along the tree in which face f hangs on ``parent[f]`` (-1 for the base)."""
    faces = goal.faces.tolist()
    side = neighbours(goal)
    base = list(parent).index(-1)
    order = [base]
    for f in order:
        order += [g for g in range(len(faces)) if parent[g] == f]
    assert len(order) == len(faces), "not a tree"
    flat = np.zeros((len(faces), 3, 2))
    index = np.arange(3 * len(faces)).reshape(-1, 3)
    slot: dict[int, int] = {}
    for f in order:
        a, b, c = goal.vertices[goal.faces[f]]
        length = np.linalg.norm(b - a)
        own = np.array(
            [
                [0, 0],
                [length, 0],
                [(c - a) @ (b - a) / length, np.linalg.norm(np.cross(b - a, c - a)) / length],
            ]
        )
        if f == base:
            flat[f] = own
            continue
        p = parent[f]
        k = next(k for k in range(3) if side.get((faces[f][(k + 1) % 3], faces[f][k]), (-1, 0))[0] == p)
        j = side[faces[f][(k + 1) % 3], faces[f][k]][1]
        start, end = flat[p][(j + 1) % 3], flat[p][j]
        old = complex(*(own[(k + 1) % 3] - own[k]))
        turn = complex(*(end - start)) / old
        turn /= abs(turn)
        for corner in range(3):
            moved = complex(*(own[corner] - own[k])) * turn + complex(*start)
            flat[f][corner] = moved.real, moved.imag
        flat[f][k], flat[f][(k + 1) % 3] = start, end
        index[f][k], index[f][(k + 1) % 3] = index[p][(j + 1) % 3], index[p][j]
        slot[f] = k
    used, compact = np.unique(index, return_inverse=True)
    compact = compact.reshape(-1, 3)
    position = np.zeros((3 * len(faces), 2))
    position[index.ravel()] = flat.reshape(-1, 2)
    edges: list[tuple[int, int]] = []
    letters: list[str] = []
    angles: list[float] = []
    number: dict[tuple[int, int], int] = {}
    crease_of = [-1] * len(faces)
    for f in order:
        for k in range(3):
            pair = tuple(sorted((int(compact[f][k]), int(compact[f][(k + 1) % 3]))))
            if pair not in number:
                number[pair] = len(edges)
                edges.append(pair)
                letters.append("B")
                angles.append(0.0)
            if slot.get(f) == k:
                angle = signed_dihedral(goal, parent[f], f, side[faces[f][(k + 1) % 3], faces[f][k]][1])
                crease_of[f] = number[pair]
                flat_joint = abs(angle) < FLAT_FOLD_RAD
                letters[number[pair]] = "F" if flat_joint else "V" if angle > 0 else "M"
                angles[number[pair]] = 0.0 if flat_joint else angle
    return Net(
        goal=goal, base_face=base, vertices=position[used], faces=compact, parent=np.array(parent),
        edges=np.array(edges), assignment=np.array(letters), fold_angle=np.array(angles),
        crease_of=np.array(crease_of),
    )  # fmt: skip


def bfs_parents(goal: GoalMesh, base: int = 0) -> list[int]:
    """A breadth-first tree that takes coplanar neighbours first."""
    side = neighbours(goal)
    faces = goal.faces.tolist()
    parent = {base: -1}
    queue = [base]
    while queue:
        f = queue.pop(0)
        panel = [f]
        for flat_only in (True, False):
            for g in panel:
                for k in range(3):
                    other = side.get((faces[g][(k + 1) % 3], faces[g][k]))
                    if other is None or other[0] in parent:
                        continue
                    flat = abs(signed_dihedral(goal, g, other[0], k)) < FLAT_FOLD_RAD
                    if flat_only and flat:
                        panel.append(other[0])
                    if flat == flat_only:
                        parent[other[0]] = g
                        if not flat_only:
                            queue.append(other[0])
    return [parent[f] for f in range(len(faces))]


def box_goal(x: float = 20.0, y: float = 30.0, z: float = 10.0) -> GoalMesh:
    """A closed box, two triangles a side."""
    v = np.array([[i * x, j * y, k * z] for k in (0, 1) for j in (0, 1) for i in (0, 1)], float)
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return GoalMesh(v, np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])]), name="box")


def rerooted(parent: Sequence[int], base: int) -> list[int]:
    """The same tree, hung up at ``base``."""
    out = list(parent)
    child, up = -1, base
    while up >= 0:
        above, out[up] = out[up], child
        child, up = up, above
    return out


def cross_net(size: float = 20.0, base: int = 2) -> Net:
    """A cube laid out around its bottom; base 0, the bottom itself, would have no free edge."""
    goal = box_goal(size, size, size)
    return net_from_parents(goal, rerooted(bfs_parents(goal), base))


def strip_goal(count: int = 6, width: float = 10.0, angle_deg: float = 20.0) -> GoalMesh:
    """An open strip of quads, each turned by ``angle_deg`` against the one before it."""
    points, heading = [np.zeros(2)], 0.0
    for _ in range(count):
        points.append(points[-1] + 8.0 * np.array([np.cos(heading), np.sin(heading)]))
        heading += np.radians(angle_deg)
    v = [(p[0], y, p[1]) for p in points for y in (0.0, width)]
    faces = [f for k in range(count) for f in ([2 * k, 2 * k + 2, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 1])]
    return GoalMesh(np.array(v), np.array(faces), name="strip")


def plate_goal(x: float = 40.0, y: float = 25.0) -> GoalMesh:
    """A flat plate of two triangles: nothing to fold."""
    return GoalMesh(
        np.array([[0, 0, 0], [x, 0, 0], [x, y, 0], [0, y, 0]], float),
        np.array([[0, 1, 2], [0, 2, 3]]),
        name="plate",
    )


def pyramid_goal(sides: int = 5, radius: float = 20.0, height: float = 15.0) -> GoalMesh:
    """An open pyramid without its floor: a fan around the apex with one wedge in its net."""
    ring = [(radius * np.cos(a), radius * np.sin(a), 0.0) for a in np.arange(sides) * 2 * np.pi / sides]
    faces = [[0, 1 + k, 1 + (k + 1) % sides] for k in range(sides)]
    return GoalMesh(np.array([(0.0, 0.0, height), *ring]), np.array(faces), name="pyramid")
