"""Forward kinematics: where every face of a net is when its creases stand at given angles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.net import Net

__all__ = ["face_transforms", "folded_triangles", "rigid_fit", "rotation_about_line"]


def rotation_about_line(
    start: NDArray[np.float64], end: NDArray[np.float64], angle_rad: float
) -> NDArray[np.float64]:
    """(4, 4) right-handed rotation by ``angle_rad`` about the line from ``start`` to ``end`` (3,).

    Source: Rodrigues' rotation formula.
    """
    axis = (end - start) / np.linalg.norm(end - start)
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.eye(3) + np.sin(angle_rad) * cross + (1.0 - np.cos(angle_rad)) * (cross @ cross)
    out = np.eye(4)
    out[:3, :3] = turn
    out[:3, 3] = start - turn @ start
    return out


def face_transforms(net: Net, angles_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """(F, 4, 4) rigid motion of every face from the flat sheet, base face at rest.

    Args:
        net: the net.
        angles_rad: (E,) fold angle of every edge of the net; only creases count.
    """
    transforms = np.empty((len(net.faces), 4, 4))
    transforms[net.base_face] = np.eye(4)
    for face in net.order[1:].tolist():
        start, end = net.hinge(face)
        turn = rotation_about_line(
            np.append(start, 0.0), np.append(end, 0.0), float(angles_rad[net.crease_of[face]])
        )
        transforms[face] = transforms[net.parent[face]] @ turn
    return transforms


def folded_triangles(net: Net, angles_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """(F, 3, 3) corners of every face in mm when the creases stand at ``angles_rad`` (E,)."""
    flat = np.zeros((len(net.faces), 3, 3))
    flat[:, :, :2] = net.vertices[net.faces]
    transforms = face_transforms(net, angles_rad)
    moved: NDArray[np.float64] = (
        np.einsum("fij,fkj->fki", transforms[:, :3, :3], flat) + transforms[:, None, :3, 3]
    )
    return moved


def rigid_fit(
    points: NDArray[np.float64], target: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotation (3, 3) and translation (3,) that bring ``points`` (N, 3) nearest to ``target`` (N, 3).

    No mirror. Source: Kabsch, Acta Cryst. A32 (1976) 922.
    """
    centre_p, centre_t = points.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((points - centre_p).T @ (target - centre_t))
    turn = vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    return turn, centre_t - turn @ centre_p
