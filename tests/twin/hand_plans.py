"""Plans made by plain reference code, for tests of the twin: breadth-first nets, outside-in folds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.fold_plan import Clip, Fold, FoldPlan, MachineLimits, PlanMetrics, Rotate, Sheet, Step
from planner.goal_mesh import GoalMesh
from planner.net import Net

FLAT = np.radians(0.05)


def breadth_first_net(goal: GoalMesh, base: int = 0) -> Net:
    """Unfold along a breadth-first tree, coplanar neighbours first; it may overlap."""
    faces = goal.faces.tolist()
    side: dict[tuple[int, int], tuple[int, int]] = {}
    for f, corners in enumerate(faces):
        for k in range(3):
            side[corners[k], corners[(k + 1) % 3]] = (f, k)
    parent, order, slot = {base: -1}, [base], {}
    queue = [base]
    while queue:
        f = queue.pop(0)
        panel = [f]
        for g in panel:
            for k in range(3):
                other = side.get((faces[g][(k + 1) % 3], faces[g][k]))
                if other and other[0] not in parent and abs(_dihedral(goal, g, other[0], k)) < FLAT:
                    parent[other[0]], slot[other[0]] = g, other[1]
                    order.append(other[0])
                    panel.append(other[0])
        for g in panel:
            for k in range(3):
                other = side.get((faces[g][(k + 1) % 3], faces[g][k]))
                if other and other[0] not in parent:
                    parent[other[0]], slot[other[0]] = g, other[1]
                    order.append(other[0])
                    queue.append(other[0])
    flat = np.zeros((len(faces), 3, 2))
    index = np.arange(3 * len(faces)).reshape(-1, 3)
    shape = [_laid_flat(goal.vertices[f]) for f in goal.faces]
    flat[base] = shape[base]
    for f in order[1:]:
        k, p = slot[f], parent[f]
        a, b = faces[f][k], faces[f][(k + 1) % 3]
        ia, ib = faces[p].index(a), faces[p].index(b)
        start, end = flat[p][ia], flat[p][ib]
        own = shape[f]
        u = (end - start) / np.linalg.norm(end - start)
        v = (own[(k + 1) % 3] - own[k]) / np.linalg.norm(own[(k + 1) % 3] - own[k])
        turn = np.array([[u @ v, v[1] * u[0] - v[0] * u[1]], [0, 0]])
        cos, sin = u @ v, v[0] * u[1] - v[1] * u[0]
        turn = np.array([[cos, -sin], [sin, cos]])
        flat[f] = start + (own - own[k]) @ turn.T
        index[f][k], index[f][(k + 1) % 3] = index[p][ia], index[p][ib]
    used, compact = np.unique(index, return_inverse=True)
    position = np.zeros((3 * len(faces), 2))
    for f in reversed(order):  # the parent's corner wins
        position[index[f]] = flat[f]
    corners = compact.reshape(-1, 3)
    edges: list[tuple[int, int]] = []
    number: dict[frozenset[int], int] = {}
    for f in range(len(faces)):
        for k in range(3):
            key = frozenset((int(corners[f][k]), int(corners[f][(k + 1) % 3])))
            if key not in number:
                number[key] = len(edges)
                edges.append((int(corners[f][k]), int(corners[f][(k + 1) % 3])))
    letters, angle, crease_of = ["B"] * len(edges), [0.0] * len(edges), [-1] * len(faces)
    for f in order[1:]:
        k = slot[f]
        e = number[frozenset((int(corners[f][k]), int(corners[f][(k + 1) % 3])))]
        turn = _dihedral(goal, f, parent[f], k)
        crease_of[f] = e
        letters[e] = "F" if abs(turn) < FLAT else "V" if turn > 0 else "M"
        angle[e] = 0.0 if abs(turn) < FLAT else turn
    return Net(
        goal=goal, base_face=base, vertices=position[used], faces=corners,
        parent=np.array([parent[f] for f in range(len(faces))]), edges=np.array(edges),
        assignment=np.array(letters), fold_angle=np.array(angle), crease_of=np.array(crease_of),
    )  # fmt: skip


def _laid_flat(corners: np.ndarray) -> np.ndarray:
    a, b, c = corners
    length = np.linalg.norm(b - a)
    x = (c - a) @ (b - a) / length
    y = np.linalg.norm(np.cross(b - a, c - a)) / length
    return np.array([[0, 0], [length, 0], [x, y]])


def _dihedral(goal: GoalMesh, face: int, other: int, k: int) -> float:
    """Fold angle across edge k of ``face``: positive = valley seen from outside."""
    a, b = goal.vertices[goal.faces[face][k]], goal.vertices[goal.faces[face][(k + 1) % 3]]
    n, m = goal.face_normals[face], goal.face_normals[other]
    u = (b - a) / np.linalg.norm(b - a)
    return -float(np.arctan2(np.cross(n, m) @ u, n @ m))


def ring_sheet(net: Net, gap: float = 5.0, margin: float = 10.0) -> Sheet:
    """A rectangular ring around the bounds of the net: nothing that the part could touch in its plane."""
    low, high = net.vertices.min(axis=0) - gap, net.vertices.max(axis=0) + gap
    inner = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    outer = inner + margin * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    vertices = np.vstack([outer, inner])
    faces = [f for k in range(4) for f in ([k, (k + 1) % 4, 4 + (k + 1) % 4], [k, 4 + (k + 1) % 4, 4 + k])]
    return Sheet(
        outline=outer, vertices=vertices, faces=np.array(faces), frame_faces=np.ones(8, bool), tabs=(),
        rotary_axis=np.array([[0.0, 0], [1, 0]]),
    )  # fmt: skip


def outside_in_steps(net: Net, angles: np.ndarray | None = None) -> list[Step]:
    """Every crease once, the farthest from the base first, each from its own side."""
    wanted = net.fold_angle if angles is None else angles
    depth = np.zeros(len(net.faces), int)
    for f in net.order[1:].tolist():
        depth[f] = depth[net.parent[f]] + 1
    faces = sorted(net.order[1:].tolist(), key=lambda f: (-depth[f], f))
    steps: list[Step] = []
    side = 0.0
    for f in faces:
        crease = int(net.crease_of[f])
        if abs(wanted[crease]) < FLAT:
            continue
        need = 0.0 if wanted[crease] > 0 else float(np.pi)
        if need != side:
            steps.append(Rotate(need))
            side = need
        steps.append(Fold(crease, float(wanted[crease])))
    return steps


def plan_of(
    net: Net,
    steps: Sequence[Step] | None = None,
    sheet: Sheet | None = None,
    limits: MachineLimits | None = None,
    without: tuple[str, ...] | None = None,
) -> FoldPlan:
    """A plan of folds alone: nothing is cut, so ``held`` is switched off unless told otherwise."""
    return FoldPlan(
        net=net, sheet=sheet or ring_sheet(net), limits=limits or MachineLimits(),
        steps=tuple(outside_in_steps(net) if steps is None else steps), metrics=PlanMetrics(1.0, 0.0, 0.0, 0),
        without=("held",) if without is None else without,
    )  # fmt: skip


def box(x: float = 20.0, y: float = 30.0, z: float = 10.0) -> GoalMesh:
    v = np.array([[i * x, j * y, k * z] for k in (0, 1) for j in (0, 1) for i in (0, 1)], float)
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    faces = [f for a, b, c, d in quads for f in ([a, b, c], [a, c, d])]
    return GoalMesh(v, np.array(faces), name="box")


def icosahedron(size: float = 20.0, split: int = 0) -> GoalMesh:
    g = (1 + 5**0.5) / 2
    v = [[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g], [0, -1, -g], [0, 1, -g],
         [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]]  # fmt: skip
    f = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2],
         [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5],
         [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]]  # fmt: skip
    vertices = [np.array(p, float) / np.linalg.norm(p) for p in v]
    for _ in range(split):
        middle: dict[tuple[int, int], int] = {}

        def between(a: int, b: int, middle: dict[tuple[int, int], int] = middle) -> int:
            key = (min(a, b), max(a, b))
            if key not in middle:
                p = vertices[a] + vertices[b]
                middle[key] = len(vertices)
                vertices.append(p / np.linalg.norm(p))
            return middle[key]

        f = [
            t
            for a, b, c in f
            for t in (
                [a, between(a, b), between(c, a)],
                [b, between(b, c), between(a, b)],
                [c, between(c, a), between(b, c)],
                [between(a, b), between(b, c), between(c, a)],
            )
        ]
    return GoalMesh(size * np.array(vertices), np.array(f), name=f"ico{len(f)}")


def star(points: int = 5, inner: float = 10.0, outer: float = 30.0, lift: float = 15.0) -> GoalMesh:
    """An open star: a flat polygon with one triangle per side bent up by different amounts."""
    ring = [
        (inner * np.cos(2 * np.pi * k / points), inner * np.sin(2 * np.pi * k / points), 0.0)
        for k in range(points)
    ]
    tips = []
    for k in range(points):
        a = 2 * np.pi * (k + 0.5) / points
        tips.append((outer * np.cos(a), outer * np.sin(a), lift * (1 if k % 2 else -1)))
    v = np.array([(0.0, 0.0, 0.0), *ring, *tips])
    faces = [[0, 1 + k, 1 + (k + 1) % points] for k in range(points)]
    faces += [[1 + k, 1 + points + k, 1 + (k + 1) % points] for k in range(points)]
    return GoalMesh(v, np.array(faces), name="star")


__all__ = [
    "Clip",
    "box",
    "breadth_first_net",
    "icosahedron",
    "outside_in_steps",
    "plan_of",
    "ring_sheet",
    "star",
]
