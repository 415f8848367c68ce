"""A small finished plan, built without the planner: a pyramid of which one wall stays blocked."""

from __future__ import annotations

import numpy as np

from planner.fold_plan import (
    Blocked,
    Clip,
    Cut,
    Fold,
    FoldPlan,
    MachineLimits,
    PlanMetrics,
    Release,
    Rotate,
    Sheet,
    Tab,
    Wait,
)  # fmt: skip
from planner.goal_mesh import GoalMesh
from planner.net import Net, NetCertificate


def small_goal() -> GoalMesh:
    """A pyramid of four triangles over a square of two, 20 mm wide, outer side outwards."""
    vertices = [(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0), (0, 0, -12)]
    faces = [(0, 1, 2), (0, 2, 3), (1, 0, 4), (2, 1, 4), (3, 2, 4), (0, 3, 4)]
    return GoalMesh(np.array(vertices, float), np.array(faces), name="pyramid", source_sha256="ab" * 32)


def small_net() -> Net:
    """The star net of the pyramid around its square."""
    goal = small_goal()
    square = np.array([(-10, -10), (10, -10), (10, 10), (-10, 10)], float)
    height = float(np.hypot(10, 12))
    tips = np.array([(0, -10 - height), (10 + height, 0), (0, 10 + height), (-10 - height, 0)])
    vertices = np.vstack([square, tips])
    faces = [(0, 1, 2), (0, 2, 3), (1, 0, 4), (2, 1, 5), (3, 2, 6), (0, 3, 7)]
    edges = [
        (0, 1),
        (1, 2),
        (2, 3),
        (0, 3),
        (0, 2),
        (0, 4),
        (1, 4),
        (1, 5),
        (2, 5),
        (2, 6),
        (3, 6),
        (3, 7),
        (0, 7),
    ]
    fold = -(np.pi - np.arctan2(12, 10))
    return Net(
        goal=goal, base_face=0, vertices=vertices, faces=np.array(faces),
        parent=np.array([-1, 0, 0, 0, 1, 1]), edges=np.array(edges),
        assignment=np.array(list("MMMMF" + "B" * 8)),
        fold_angle=np.array([fold] * 4 + [0.0] * 9), crease_of=np.array([-1, 4, 0, 1, 2, 3]),
        certificate=NetCertificate(0, 0, optimal=True),
    )  # fmt: skip


def small_plan() -> FoldPlan:
    """Fold three walls from below all the way and the last one half of it; one piece is clipped."""
    net = small_net()
    w, h = 60.0, 50.0
    outline = np.array([(-w, -h), (w, -h), (w, h), (-w, h)])
    inner = np.array([(-35, -35), (35, -35), (35, 35), (-35, 35)], float)
    faces = []
    for k in range(4):
        n = (k + 1) % 4
        faces += [(k, n, 4 + n), (k, 4 + n, 4 + k)]
    faces += [(4, 5, 8)]
    sheet = Sheet(
        outline=outline, vertices=np.vstack([outline, inner, [(0.0, -30.0)]]), faces=np.array(faces),
        frame_faces=np.array([True] * 8 + [False]), tabs=(Tab(7, (12.0, -9.0), (13.0, -8.0)),),
        rotary_axis=np.array([(-100.0, 0.0), (100.0, 0.0)]),
    )  # fmt: skip
    full = float(net.fold_angle[0])
    around = ((-10.0, -10.0), (0.0, -25.62), (10.0, -10.0))
    steps = (
        Cut((around,), "frees crease 0"), Clip((8,)), Rotate(np.pi), Fold(0, full), Wait(2.0),
        Fold(1, 0.5 * full), Fold(2, full), Fold(3, full), Fold(1, 0.6 * full), Rotate(0.0),
        Release((((12.0, -9.0), (13.0, -8.0)),)),
    )  # fmt: skip
    return FoldPlan(
        net=net, sheet=sheet, limits=MachineLimits(), steps=steps,
        metrics=PlanMetrics(0.9, 1.25, 0.0625, 2, 1, 175.0),
        blocked=(Blocked(1, 0.6 * full, full, "collision", (2, 4), 0.61 * full),),
    )  # fmt: skip
