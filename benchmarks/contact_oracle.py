"""Exact first contacts of the turns of real plans against dense sampling with python-fcl.

``python -m benchmarks.contact_oracle MESH …`` folds each mesh as planned and, before every turn, asks how far
the crease could turn on from there: to its goal angle or, with ``--beyond``, by so many degrees more, where
many turns do end in contact. The exact answer is compared with samples at 0.1 and at 1 degree.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.plan_evaluation import PRISM_FACES
from planner import MachineLimits, make_net, read_goal
from planner._kernels.contact_kernels import turn_contact
from planner._kernels.plan_kernels import turn_solids
from planner._kernels.tree_kernels import subtree_ranges
from planner.fold_problem import FoldProblem, bounding_spheres
from planner.goal_mesh import GoalMesh
from planner.insets import edge_insets
from planner.plan_on_sheet import tree_of_net

FINE_RAD, COARSE_RAD = math.radians(0.1), math.radians(1.0)


@dataclass
class Counts:
    """What was compared.

    Attributes:
        turns: turns.
        contacts: turns in which the exact test finds a contact.
        missed: turns in which a fine sample touches before the exact contact: errors of the exact test.
        unconfirmed: contacts that neither fine samples nor samples just behind them show; not counted where
            faces are too slim for a prism alone, because the samples know prisms only.
        missed_fine: contacts that no fine sample shows.
        missed_coarse: contacts that no coarse sample shows.
        late_deg: how much later than the exact contact a coarse sample first shows one, at most.
    """

    turns: int = 0
    contacts: int = 0
    missed: int = 0
    unconfirmed: int = 0
    missed_fine: int = 0
    missed_coarse: int = 0
    late_deg: float = 0.0

    def __iadd__(self, other: Counts) -> Counts:
        """Add the counts of another mesh."""
        for name in ("turns", "contacts", "missed", "unconfirmed", "missed_fine", "missed_coarse"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.late_deg = max(self.late_deg, other.late_deg)
        return self


class Swing:
    """What moves and what stands still in one turn, as collision meshes; the joined pair is left out."""

    def __init__(
        self, prisms: NDArray[np.float64], members: NDArray[np.int64], face: int, parent: int
    ) -> None:
        still = np.ones(len(prisms), np.bool_)
        still[members] = False
        others = members[members != face]
        self.pairs = [(_mesh(prisms[others]), _mesh(prisms[still]))] if len(others) else []
        still[parent] = False
        if still.any():
            self.pairs.append((_mesh(prisms[[face]]), _mesh(prisms[still])))

    def touches(self, pose: tuple[NDArray[np.float64], NDArray[np.float64]]) -> bool:
        """True if anything touches when the moving part is turned by ``pose``."""
        import fcl

        for moving, standing in self.pairs:
            moving.setTransform(fcl.Transform(*pose))
            if fcl.collide(moving, standing, fcl.CollisionRequest(), fcl.CollisionResult()):
                return True
        return False

    def first(self, line: Sequence[float], start: float, end: float, step: float) -> float | None:
        """First multiple of ``step`` in (start, end], or the end, at which something touches."""
        for k in range(math.floor(start / step) + 1, math.ceil(end / step) + 1):
            angle = min(end, k * step)
            if self.touches(turned(line, angle)):
                return angle
        return None


def _mesh(prisms: NDArray[np.float64]) -> Any:  # noqa: ANN401  fcl has no types
    import fcl

    faces = (PRISM_FACES[None] + 6 * np.arange(len(prisms))[:, None, None]).reshape(-1, 3)
    body = fcl.BVHModel()
    body.beginModel(6 * len(prisms), len(faces))
    body.addSubModel(np.ascontiguousarray(prisms.reshape(-1, 3)), faces)
    body.endModel()
    return fcl.CollisionObject(body)


def turned(line: Sequence[float], angle: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotation (3, 3) and shift (3,) of a turn about the line through (x, y, 0) along (ux, uy, 0)."""
    ox, oy, ux, uy = line
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array(
        [
            [c + ux * ux * (1 - c), ux * uy * (1 - c), uy * s],
            [ux * uy * (1 - c), c + uy * uy * (1 - c), -ux * s],
            [-uy * s, ux * s, c],
        ]
    )
    pivot = np.array([ox, oy, 0.0])
    return turn, pivot - turn @ pivot


def compare(goal: GoalMesh, *, beyond_rad: float = 0.0, tilt_rad: float = math.radians(45.0)) -> Counts:
    """Fold ``goal`` as planned and compare every turn, and ``beyond_rad`` more than its goal angle."""
    limits = MachineLimits(max_tilt_rad=tilt_rad)
    net = make_net(goal)
    problem = FoldProblem(goal, edge_insets(net, limits.thickness, limits.clearance), limits)
    tree = tree_of_net(net)
    result = problem.fold(tree)
    solids = problem.solids(tree)
    centres, radii = bounding_spheres(solids)
    preorder, first, last = subtree_ranges(tree.parent, tree.order)
    hinges, _ = tree.hinge_lines
    present, mask = np.ones(len(solids), np.bool_), np.zeros(len(solids), np.bool_)
    angle, work, out = np.zeros(len(solids)), np.zeros((30, 3)), Counts()
    for _, which, value in result.steps[result.steps[:, 0] == 1].tolist():
        face = int(which)
        members, (ox, oy, ux, uy) = preorder[first[face] : last[face]], hinges[face].tolist()
        sign = math.copysign(1.0, tree.target[face])
        limit = min(math.pi, abs(tree.target[face] - angle[face]) + beyond_rad)
        found, _, by = turn_contact(
            face, int(tree.parent[face]), members, mask, solids, centres, radii, problem.sharp, present,
            ox, oy, sign * ux, sign * uy, limit, work,
        )  # fmt: skip
        swing, line = (
            Swing(solids[:, :6], members, face, int(tree.parent[face])),
            (ox, oy, sign * ux, sign * uy),
        )
        out.turns += 1
        out.missed += swing.first(line, 0.0, found - 1e-6, FINE_RAD) is not None
        if by >= 0:
            out.contacts += 1
            fine = swing.first(line, found, limit, FINE_RAD)
            coarse = swing.first(line, found, limit, COARSE_RAD)
            behind = any(swing.touches(turned(line, found + after)) for after in (1e-6, 1e-5, 1e-4, 1e-3))
            out.unconfirmed += fine is None and not behind and not problem.sharp.any()
            out.missed_fine += fine is None
            out.missed_coarse += coarse is None
            out.late_deg = max(out.late_deg, math.degrees((coarse or found) - found))
        turn_solids(solids, centres, members, ox, oy, ux, uy, value - angle[face])
        angle[face] = value
    return out


def main(arguments: Sequence[str] | None = None) -> None:
    """Print one line per mesh and the sum."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("meshes", type=Path, nargs="+")
    parser.add_argument("--beyond", type=float, default=0.0, help="degrees past the goal angle")
    options = parser.parse_args(arguments)
    total = Counts()
    for mesh in options.meshes:
        counts = compare(read_goal(mesh, size_mm=60.0), beyond_rad=math.radians(options.beyond))
        total += counts
        print(mesh.stem, counts, flush=True)
    print("all", total)


if __name__ == "__main__":
    main()
