"""Which creases matter: the share of each in the variance of the folded shape, to first order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.net import Net
from twin.scatter_draws import FoldTurn, ScatterFigures
from twin.shape_error import folded_draws

__all__ = ["CreaseShare", "VarianceShares", "shape_sensitivity", "variance_shares"]


@dataclass(frozen=True)
class CreaseShare:
    """What one crease does to the shape.

    Attributes:
        crease: net edge.
        share: of the expected square of the shape error, by its own scatter.
        sigma_rad: standard deviation of its angle by its own scatter.
        mm_per_rad: RMS displacement of the face corners per radian at this crease.
    """

    crease: int
    share: float
    sigma_rad: float
    mm_per_rad: float


@dataclass(frozen=True)
class VarianceShares:
    """Expected shape error to first order, and where it comes from; nothing measured.

    Attributes:
        sheet: share of the factor that all creases have in common.
        creases: all creases that are folded, largest share first.
        rms_mm: square root of the expected square of the shape error against the planned shape, mm.
    """

    sheet: float
    creases: tuple[CreaseShare, ...]
    rms_mm: float


def shape_sensitivity(
    net: Net, angles_rad: NDArray[np.float64], creases: Sequence[int]
) -> NDArray[np.float64]:
    """(9 F, C) displacement of all face corners, mm per rad, less the best rigid motion.

    A point turns about the folded crease with the velocity ``axis x (point - origin)``; the six rigid motions
    of the whole part are projected out, which is what a best fit does to first order.

    Args:
        net: the net.
        angles_rad: (E,) fold angles about which it is taken.
        creases: (C,) net edges.
    """
    corners = folded_draws(net, angles_rad[None])[0]
    points = corners.reshape(-1, 3)
    out = np.zeros((len(creases), len(net.faces), 3, 3))
    for n, crease in enumerate(creases):
        face = int(net.child_of[crease])
        members = net.subtree[face]
        slot = _slot(net, face)
        start, end = corners[face, slot], corners[face, (slot + 1) % 3]
        axis = (end - start) / np.linalg.norm(end - start)
        out[n, members] = np.cross(axis, corners[members] - start)
    middle = points - points.mean(axis=0)
    rigid = np.zeros((6, len(points), 3))
    for k, unit in enumerate(np.eye(3)):
        rigid[k] = unit
        rigid[3 + k] = np.cross(unit, middle)
    basis, scale, _ = np.linalg.svd(rigid.reshape(6, -1).T, full_matrices=False)
    basis = basis[:, scale > 1e-9 * scale[0]]
    moved = out.reshape(len(creases), -1).T
    free: NDArray[np.float64] = moved - basis @ (basis.T @ moved)
    return free


def variance_shares(net: Net, turns: Sequence[FoldTurn], figures: ScatterFigures) -> VarianceShares:
    """Shares of sheet and creases in the expected squared shape error, nothing measured."""
    angles = np.zeros(len(net.edges))
    variance: dict[int, float] = {}
    total: dict[int, float] = {}
    for turn in turns:
        each = np.asarray(turn.increments_rad)
        angles[turn.crease] = turn.to_rad
        total[turn.crease] = total.get(turn.crease, 0.0) + float(each.sum())
        random = figures.per_pass**2 * float(each @ each) + len(each) * figures.additive_rad**2
        variance[turn.crease] = variance.get(turn.crease, 0.0) + random
    creases = sorted(total)
    if not creases:
        return VarianceShares(0.0, (), 0.0)
    planned = np.array([total[c] for c in creases])
    own = np.array([variance[c] for c in creases]) + (figures.crease * planned) ** 2
    moved = shape_sensitivity(net, angles, creases)
    count = 3 * len(net.faces)
    square = (moved**2).sum(axis=0) / count
    common = float(((moved @ (figures.sheet * planned)) ** 2).sum()) / count
    parts = square * own
    whole = float(parts.sum()) + common
    shares = parts / whole if whole > 0.0 else np.zeros(len(parts))
    order = np.argsort(-shares, kind="stable")
    return VarianceShares(
        sheet=common / whole if whole > 0.0 else 0.0,
        creases=tuple(
            CreaseShare(
                creases[k], float(shares[k]), float(np.sqrt(own[k])), float(np.sqrt(square[k]))
            )
            for k in order.tolist()
        ),
        rms_mm=float(np.sqrt(whole)),
    )  # fmt: skip


def _slot(net: Net, face: int) -> int:
    """Corner of ``face`` at which its crease starts."""
    start, end = net.hinge(face)
    flat = net.vertices[net.faces[face]]
    for k in range(3):
        a, b = flat[k], flat[(k + 1) % 3]
        if np.array_equal(a, start) and np.array_equal(b, end):
            return k
    raise ValueError(f"face {face} has no corner at its own crease")
