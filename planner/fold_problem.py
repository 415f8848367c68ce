"""One goal under given limits, ready for the greedy fold planner: solids, levers, figures of a result."""

from __future__ import annotations

import threading
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import MachineLimits
from planner.goal_mesh import GoalMesh
from planner.insets import is_sharp, plain_insets
from planner.kinematics import rigid_fit

if TYPE_CHECKING:
    from planner.own_sight import OwnSight

__all__ = [
    "CONTACT_MARGIN_RAD", "RULES", "FlatTree", "FoldProblem", "FoldResult", "bounding_spheres",
    "rotary_angles",
]  # fmt: skip

CONTACT_MARGIN_RAD = 0.003
"""Angle that a crease keeps before a contact."""

RULES = ("outside-in", "side", "sight", "contact", "substrate", "held", "clearance")
"""Names of the rules that a study may switch off."""

SAFE_LOAD = 0.3
"""Share of the yielding moment that a crease carries without remark."""

BY_ORDER, HELD_BACK = 3, 4
"""Further causes: a crease waits for others that stay short; it is left short so that others go further."""

SIGHT_RESERVE = 0.5
"""Share of ``hidden_max`` that the planner uses: it looks every few degrees, and an independent check samples
the crease, where short shadows together may cover more samples than their length is worth."""

KNOWN_TURNS = 2**17
"""Turns whose outcome a thread keeps, a power of 2, of 40 bytes each: those of a few hundred nets."""

GRAZES_DEG = (0.5, 0.8, 1.2, 2.0)
"""Tilts are also tried along the turning face as it stands so many degrees before its end: a closing slit is
lit longest that way."""


def rotary_angles(max_tilt_rad: float) -> NDArray[np.float64]:
    """(K,) rotary angles that the planner chooses from, the first half with the top side up.

    Straight beams first, then tilts of half the limit and of all of it, to both sides.
    """
    tilts = [0.0]
    if max_tilt_rad > np.radians(1.0):
        for share in (0.5, 1.0):
            tilts += [share * max_tilt_rad, -share * max_tilt_rad]
    top = np.array(tilts)
    return np.concatenate([top, np.pi + top])


def fine_tilts(max_tilt_rad: float) -> NDArray[np.float64]:
    """(L,) tilts, small to large, that are tried for a crease which no usual rotary angle shows fully."""
    if max_tilt_rad <= np.radians(1.0):
        return np.zeros(1)
    shares = np.array(
        [0.008, 0.016, 0.03, 0.06, 0.1, 0.16, 0.22, 0.29, 0.36, 0.43, 0.5, 0.58, 0.65, 0.74, 0.82, 0.91, 1.0]
    )
    return max_tilt_rad * np.concatenate([[0.0], np.stack([shares, -shares], axis=1).ravel()])


@dataclass(frozen=True, eq=False)
class FlatTree:
    """A flat net as plain arrays, the form in which the search passes nets on.

    Attributes:
        base: the stationary face.
        parent: (F,) parent face, -1 for the base.
        slot: (F,) corner k of the child where its crease (corner k to k + 1) starts, -1 for the base.
        order: (F,) faces, every parent before its children.
        corners: (F, 3, 2) flat positions, mm.
        target: (F,) wanted fold angle at the crease of each face in rad, 0 for flat joints and the base.
        axis: (2,) unit direction of the rotary axis in the plane of ``corners``.
        origin: (2,) point on that axis under the middle of the work area.
    """

    base: int
    parent: NDArray[np.int64]
    slot: NDArray[np.int64]
    order: NDArray[np.int64]
    corners: NDArray[np.float64]
    target: NDArray[np.float64]
    axis: NDArray[np.float64]
    origin: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def subtrees(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Faces in depth-first order, and (F,) where the subtree of each begins and ends in it."""
        from planner._kernels.tree_kernels import subtree_ranges

        preorder, first, last = subtree_ranges(self.parent, self.order)
        return preorder, first, last

    @cached_property
    def hinge_lines(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(F, 4) start and unit direction of the flat creases, and (F,) their length; void at the base."""
        rows = np.arange(len(self.parent))
        start = self.corners[rows, self.slot]
        along = self.corners[rows, (self.slot + 1) % 3] - start
        lengths = np.linalg.norm(along, axis=1)
        return np.concatenate([start, along / lengths[:, None]], axis=1), lengths


@dataclass(frozen=True, eq=False)
class FoldResult:
    """What the greedy planner reached on one net.

    Attributes:
        steps: (S, 3) rows (kind, face or rotary option, angle in rad); kinds as in the kernel.
        reached: (F,) angle at the crease of each face.
        cause: (F,) 0 folded, 1 contact, 2 sight, or ``BY_ORDER`` or ``HELD_BACK``.
        blocker: (F,) solid that stops it, -1 if none; numbers from F on are obstacles.
        toucher: (F,) face of the moving part that would touch it, -1 if it is not stopped by contact.
        stopped_at: (F,) absolute angle at which it is stopped.
        completion: sum of reached over sum of wanted angles (1 if nothing is to be folded).
        shape_rms: root mean square distance of the face corners to the goal after the best rigid fit, mm.
        rotations: how often the rotary turns.
        overload: sum over the creases of the load share above ``SAFE_LOAD``, see ``FoldProblem.loads``.
    """

    steps: NDArray[np.float64]
    reached: NDArray[np.float64]
    cause: NDArray[np.int64]
    blocker: NDArray[np.int64]
    toucher: NDArray[np.int64]
    stopped_at: NDArray[np.float64]
    completion: float
    shape_rms: float
    rotations: int
    overload: float = 0.0


class FoldProblem:
    """One goal under given limits: evaluates nets by folding them greedily with all rules on.

    Args:
        goal: the mesh to fold.
        insets: (F, 3) inset of every edge, from ``planner.insets.edge_insets``.
        limits: what rig and material allow.
        hidden_max: largest hidden share of a crease.
        without: names of rules that are switched off.
    """

    def __init__(
        self,
        goal: GoalMesh,
        insets: NDArray[np.float64],
        limits: MachineLimits,
        *,
        hidden_max: float = 0.05,
        without: Collection[str] = (),
    ) -> None:
        self.goal = goal
        self.limits = limits
        self.insets = insets
        self.hidden_max = hidden_max
        self.use_contact = "contact" not in without
        self.use_sight = "sight" not in without
        self.use_substrate = "substrate" not in without
        self.use_held = "held" not in without
        self.rotary = rotary_angles(limits.max_tilt_rad)
        self.fine = fine_tilts(limits.max_tilt_rad)
        self.grazes = np.radians(GRAZES_DEG) if limits.max_tilt_rad > 0.0 else np.zeros(0)
        self.corners_3d = goal.vertices[goal.faces]
        self.centroids_3d = self.corners_3d.mean(axis=1)
        a, b, c = (self.corners_3d[:, k] for k in range(3))
        self._double_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        mid_insets = plain_insets(self.corners_3d, limits.clearance)
        self.sharp = is_sharp(insets, mid_insets)
        self.known_turns = KNOWN_TURNS
        self.mouths: dict[bytes, NDArray[np.float64]] = {}  # see planner.hold_gap
        self._of_thread = threading.local()
        # a net lays the faces flat unchanged, so the inset corners have the same barycentric weights in any
        self._inset_shares = np.concatenate(
            [_corner_shares(self.corners_3d, insets), _corner_shares(self.corners_3d, mid_insets)], axis=1
        )

    @cached_property
    def own_sight(self) -> OwnSight | None:
        """What hides creases that it hangs on, for the search; None if that is no rule, or too much."""
        from planner.own_sight import MOST_FACES, OwnSight

        return OwnSight(self) if self.use_sight and len(self.goal.faces) <= MOST_FACES else None

    def solids(self, tree: FlatTree) -> NDArray[np.float64]:
        """(F, 12, 3) corners of every face in the flat sheet: prism, inset triangle, full triangle."""
        half = 0.5 * self.limits.thickness
        inset = self._inset_shares @ tree.corners
        out = np.zeros((len(tree.corners), 12, 3))
        out[:, 0:3, :2] = out[:, 3:6, :2] = inset[:, :3]
        out[:, 0:3, 2], out[:, 3:6, 2] = half, -half
        out[:, 6:9, :2] = inset[:, 3:]
        out[:, 9:12, :2] = tree.corners
        return out

    def loads(self, tree: FlatTree) -> NDArray[np.float64]:
        """(F,) moment of the weight that hangs on each crease over the moment at which it yields.

        Taken for the flat net held at the base panel, the worst case; 0 for flat joints and the base.
        """
        preorder, first, last = tree.subtrees
        hinges, lengths = tree.hinge_lines
        area = 0.5 * self._double_area[preorder, None]
        weighed = np.concatenate([area, area * tree.corners[preorder].mean(axis=1)], axis=1)
        sums = np.concatenate([np.zeros((1, 3)), np.cumsum(weighed, axis=0)])
        below = sums[last] - sums[first]
        arm = below[:, 1:] - below[:, :1] * hinges[:, :2]
        moment = self.limits.weight_n_mm2 * np.abs(hinges[:, 2] * arm[:, 1] - hinges[:, 3] * arm[:, 0])
        return np.where(tree.target != 0.0, moment / (self.limits.plastic_moment_n * lengths), 0.0)

    def levers(self, tree: FlatTree) -> NDArray[np.float64]:
        """(F,) rms displacement of the whole part in mm per radian missing at the crease of each face."""
        from planner._kernels.tree_kernels import lever_arms

        rows = np.arange(len(tree.parent))
        levers: NDArray[np.float64] = lever_arms(
            *tree.subtrees, tree.target, self.corners_3d[rows, tree.slot],
            self.corners_3d[rows, (tree.slot + 1) % 3], self.centroids_3d,
        )  # fmt: skip
        return levers

    def forget(self) -> None:
        """Forget the turns worked out so far: what is folded next comes out the same, but takes longer."""
        self._of_thread = threading.local()

    def _known(self) -> tuple[NDArray[np.uint64], NDArray[np.float64]]:
        """(K,) keys and (K, 4) answers of the turns that this thread remembers, see ``known_kernels``."""
        known: tuple[NDArray[np.uint64], NDArray[np.float64]] | None = getattr(self._of_thread, "known", None)
        if known is None:
            known = np.zeros(self.known_turns, dtype=np.uint64), np.zeros((self.known_turns, 4))
            self._of_thread.known = known
        return known

    def head(self, tree: FlatTree) -> NDArray[np.float64]:
        """(8,) where the light comes from, as ``beam_kernels`` wants it."""
        source = self.limits.beam_source
        radius = max(self.limits.beam_radius, 0.5 * self.limits.thickness)
        finite, place = (0.0, (0.0, 0.0, 0.0)) if source is None else (1.0, source)
        return np.array([finite, *place, *tree.origin, radius, self.limits.beam_spread])

    def fold(
        self,
        tree: FlatTree,
        *,
        obstacles: NDArray[np.float64] | None = None,
        rank: NDArray[np.int64] | None = None,
        after: NDArray[np.int64] | None = None,
        back: NDArray[np.float64] | None = None,
        give_up: float = np.inf,
        fine_sight: bool = False,
    ) -> FoldResult:
        """Fold ``tree`` as far as it goes.

        Args:
            tree: the flat net, overlap-free.
            obstacles: (M, 12, 3) solids that stand still in the sheet plane and must not be touched.
            rank: (F,) faces in the order in which they are tried; deepest first if not given.
            after: (F,) for each face another whose crease is to be folded before, -1: none; a wish only.
            back: (F,) angle, rad, by which the crease of each face is held back on purpose.
            give_up: stop early once what is conceded costs about this much; the result is then unfinished.
            fine_sight: look at a crease every quarter of a degree of its turn instead of every 1.7 degrees.
        """
        from planner._kernels.plan_kernels import ANGLE_WEIGHT, fold_greedily
        from planner._kernels.sight_kernels import FINE_SUBSTEPS, SIGHT_SUBSTEPS

        count = len(tree.parent)
        solids = self.solids(tree)
        sharp = self.sharp
        if obstacles is not None and len(obstacles):
            solids = np.concatenate([solids, obstacles])
            sharp = np.concatenate([sharp, np.zeros(len(obstacles), dtype=np.bool_)])
        centres, radii = bounding_spheres(solids)
        preorder, first, last = tree.subtrees
        hinges, lengths = tree.hinge_lines
        wanted = np.abs(tree.target)
        target, total = tree.target, wanted.sum()
        if back is not None:
            back = np.minimum(back, wanted)
            target = np.copysign(wanted - back, target)
            target[back >= wanted] = 0.0
            give_up -= ANGLE_WEIGHT * back.sum() / total
        steps, reached, cause, blocker, toucher, stopped_at = fold_greedily(
            tree.parent, preorder, first, last, hinges, lengths, target,
            np.ascontiguousarray(tree.order[::-1]) if rank is None else rank,
            np.full(count, -1) if after is None else after, self.levers(tree),
            solids, centres, radii, sharp, np.ones(len(solids), np.bool_), np.ones(len(solids), np.bool_),
            panel_numbers(tree, len(solids)), count,
            self.rotary, self.fine, self.grazes, float(tree.axis[0]), float(tree.axis[1]), self.head(tree),
            self.hidden_max * SIGHT_RESERVE, FINE_SUBSTEPS if fine_sight else SIGHT_SUBSTEPS,
            CONTACT_MARGIN_RAD, self.use_contact, self.use_sight, True,
            give_up, self.goal.longest_side_mm, self._known(),
        )  # fmt: skip
        if back is not None:
            held = (cause == 0) & (back > 0.0) & (wanted > 0.0)
            cause[held], stopped_at[held] = HELD_BACK, np.abs(reached[held])
        loads = self.loads(tree)
        return FoldResult(
            steps=steps,
            reached=reached,
            cause=cause,
            blocker=blocker,
            toucher=toucher,
            stopped_at=stopped_at,
            completion=float(np.minimum(np.abs(reached), wanted).sum() / total) if total else 1.0,
            shape_rms=shape_rms(solids[:count, 9:12], self.corners_3d),
            rotations=int((steps[:, 0] == 0).sum()),
            overload=float(np.maximum(loads - SAFE_LOAD, 0.0).sum()),
        )


def _corner_shares(triangles: NDArray[np.float64], insets: NDArray[np.float64]) -> NDArray[np.float64]:
    """(F, 3, 3) barycentric weights of the corners of ``triangles`` (F, 3, 3) set in by ``insets`` (F, 3)."""
    lengths = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2)
    a, b, c = (triangles[:, k] for k in range(3))
    share = insets * lengths / np.linalg.norm(np.cross(b - a, c - a), axis=1)[:, None]
    before = np.roll(share, 1, axis=1)
    weights = np.zeros((len(triangles), 3, 3))
    for k in range(3):
        weights[:, k, k] = 1.0 - share[:, k] - before[:, k]
        weights[:, k, (k + 1) % 3] = before[:, k]
        weights[:, k, (k + 2) % 3] = share[:, k]
    return weights


def bounding_spheres(solids: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centres (N, 3) and radii (N,) of spheres around solids (N, K, 3)."""
    by_corner = np.ascontiguousarray(solids.transpose(1, 2, 0))  # numpy reduces the first axis fastest
    centres = 0.5 * (by_corner.min(axis=0) + by_corner.max(axis=0))
    away = by_corner - centres
    away *= away
    radii = np.sqrt((away[:, 0] + away[:, 1] + away[:, 2]).max(axis=0))
    return np.ascontiguousarray(centres.T), radii


def panel_numbers(tree: FlatTree, total: int) -> NDArray[np.int64]:
    """(total,) number of the flat panel of each solid: faces on flat joints share one, obstacles have -1."""
    panel = np.full(total, -1, dtype=np.int64)
    for face in tree.order.tolist():
        up = int(tree.parent[face])
        panel[face] = panel[up] if up >= 0 and tree.target[face] == 0.0 else face
    return panel


def shape_rms(corners: NDArray[np.float64], goal_corners: NDArray[np.float64]) -> float:
    """Root mean square distance, mm, of face corners (F, 3, 3) to the goal's after the best rigid fit."""
    points, target = corners.reshape(-1, 3), goal_corners.reshape(-1, 3)
    turn, shift = rigid_fit(points, target)
    return float(np.sqrt(((points @ turn.T + shift - target) ** 2).sum(axis=1).mean()))
