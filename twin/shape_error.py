"""Shapes of many sets of fold angles at once, and how far they are from the goal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.kinematics import rotation_about_line
from planner.net import Net

__all__ = ["folded_draws", "shape_errors"]


def folded_draws(net: Net, angles_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, F, 3, 3) corners in mm of every face for N sets of angles (N, E): all draws at once."""
    count = len(angles_rad)
    turn = np.empty((count, len(net.faces), 3, 3))
    shift = np.empty((count, len(net.faces), 3))
    turn[:, net.base_face], shift[:, net.base_face] = np.eye(3), 0.0
    quarter = np.pi / 2.0
    for face in net.order[1:].tolist():
        start, end = (np.append(p, 0.0) for p in net.hinge(face))
        cross = (
            rotation_about_line(start, end, quarter)[:3, :3]
            - rotation_about_line(start, end, -quarter)[:3, :3]
        ) / 2.0
        angle = angles_rad[:, net.crease_of[face]]
        own = np.eye(3) + np.sin(angle)[:, None, None] * cross
        own += (1.0 - np.cos(angle))[:, None, None] * (cross @ cross)
        parent = int(net.parent[face])
        turn[:, face] = turn[:, parent] @ own
        offset = start - np.einsum("nij,j->ni", own, start)
        shift[:, face] = np.einsum("nij,nj->ni", turn[:, parent], offset) + shift[:, parent]
    flat = np.zeros((len(net.faces), 3, 3))
    flat[:, :, :2] = net.vertices[net.faces]
    corners: NDArray[np.float64] = np.einsum("nfij,fkj->nfki", turn, flat, optimize=True) + shift[:, :, None]
    return corners


def shape_errors(net: Net, corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """RMS (N,) and largest (N,) distance in mm of face corners (N, F, 3, 3) from the goal, best rigid fits.

    No mirror. Source: Kabsch, Acta Cryst. A32 (1976) 922.
    """
    points = corners.reshape(len(corners), -1, 3)
    target = net.goal.vertices[net.goal.faces].reshape(-1, 3)
    p = points - points.mean(axis=1, keepdims=True)
    t = target - target.mean(axis=0)
    u, _, vt = np.linalg.svd(np.einsum("npi,pj->nij", p, t))
    sign = np.ones((len(p), 3))
    sign[:, 2] = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    turn = np.einsum("nij,nj,njk->nik", u, sign, vt)
    distance = np.linalg.norm(p @ turn - t, axis=2)
    return np.sqrt((distance**2).mean(axis=1)), distance.max(axis=1)
