"""Bends with a radius: how far the faces of a net move in the flat so that the folded part has its size.

A crease is a line only in the net. In metal, a strip of some width beside it bends to an arc, and the
fibre that keeps its length lies beyond the middle of the sheet, away from the beam, which shrinks the metal
that it heats. Seen in the middle surface, each crease takes up a little more or less metal than a sharp one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.kinematics import rotation_about_line
from planner.net import Net

__all__ = ["bend_deduction", "bend_radius", "bent_triangles", "face_shifts", "outward"]


def bend_radius(angle_rad: NDArray[np.float64], width_mm: float, shift_mm: float) -> NDArray[np.float64]:
    """Radius in mm of the middle surface where a strip of ``width_mm`` bends by ``angle_rad`` (any shape).

    ``width / |angle| - shift``, because the arc of the neutral fibre is as long as the strip; 0 where the
    metal is used up, infinite at angle 0.

    Raises:
        ValueError: if a length is negative or not finite.
    """
    _check_lengths(width_mm, shift_mm)
    angle = np.abs(np.asarray(angle_rad, dtype=np.float64))
    with np.errstate(divide="ignore"):
        radius = np.where(angle > 0.0, width_mm / np.where(angle > 0.0, angle, 1.0) - shift_mm, np.inf)
    kept: NDArray[np.float64] = np.maximum(radius, 0.0)
    return kept


def bend_deduction(angle_rad: NDArray[np.float64], width_mm: float, shift_mm: float) -> NDArray[np.float64]:
    """How much nearer in mm the two faces at a crease lie in the flat than a sharp crease would have them.

    ``2 r tan(|angle| / 2) - width`` with r from ``bend_radius``: twice the setback less the flat strip.
    Negative where the loss in the neutral fibre outweighs the arc, as in thin metal with a narrow strip.
    Limits: ``width * angle² / 12`` for a small angle without shift, ``-shift * |angle|`` for a narrow strip.

    Source: bend deduction and K-factor of sheet metal work (Machinery's Handbook, "Bending of sheet metal"),
    measured here on the middle surface: with inner radius R, thickness T and neutral fibre at K T from the
    inner side, r = R + T / 2, shift = (K - 1/2) T, and width = angle (R + K T).

    Args:
        angle_rad: fold angles, any shape; the sign does not matter.
        width_mm: width of the strip that bends, in the flat.
        shift_mm: distance of the neutral fibre beyond the middle of the sheet, away from the beam.

    Raises:
        ValueError: if a length is negative or not finite, or an angle is not within -180° and 180°.
    """
    _check_lengths(width_mm, shift_mm)
    angle = np.abs(np.asarray(angle_rad, dtype=np.float64))
    if not np.all(angle < np.pi):
        raise ValueError("fold angles must be finite and lie within -180 and 180 degrees")
    half = 0.5 * angle
    # tan(x) / x - 1 loses its digits where x is small; its series is exact there.
    series = half**2 * (1.0 / 3.0 + half**2 * (2.0 / 15.0 + half**2 * 17.0 / 315.0))
    excess = np.where(half < 0.02, series, np.tan(half) / np.where(half > 0.0, half, 1.0) - 1.0)
    arc: NDArray[np.float64] = width_mm * excess - 2.0 * shift_mm * np.tan(half)
    return np.where(shift_mm * angle > width_mm, -width_mm, arc)


def outward(net: Net, face: int) -> NDArray[np.float64]:
    """(2,) unit normal of the crease of ``face`` in the flat, from its parent to it."""
    start, end = net.hinge(face)
    along = (end - start) / np.linalg.norm(end - start)
    return np.array([-along[1], along[0]])  # the face lies to the left of its own boundary


def face_shifts(
    net: Net, angles_rad: NDArray[np.float64], width_mm: float, shift_mm: float
) -> NDArray[np.float64]:
    """(F, 2) how every face moves in the flat, mm: the deductions of all creases from the base face to it.

    Args:
        net: the net.
        angles_rad: (E,) fold angle of every edge at the end; only creases count.
        width_mm: see ``bend_deduction``.
        shift_mm: see ``bend_deduction``.
    """
    deduction = bend_deduction(np.asarray(angles_rad)[net.crease_of], width_mm, shift_mm)
    shifts = np.zeros((len(net.faces), 2))
    for face in net.order[1:].tolist():
        shifts[face] = shifts[net.parent[face]] - deduction[face] * outward(net, face)
    return shifts


def bent_triangles(
    net: Net,
    angles_rad: NDArray[np.float64],
    width_mm: float,
    shift_mm: float,
    shifts: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(F, 3, 3) corners of every face in mm where the metal really is: each crease bent to an arc.

    The flat faces are those of ``net``, each moved by its row of ``shifts`` (F, 2), and the strip that bends
    lies with its middle half-way between the crease of the parent and that of the child. With zeros this is
    the net cut out as it is; with ``face_shifts`` of the same angles it is ``folded_triangles``.
    """
    deduction = bend_deduction(np.asarray(angles_rad)[net.crease_of], width_mm, shift_mm)
    pose = np.empty((len(net.faces), 4, 4))
    pose[net.base_face] = np.eye(4)
    for face in net.order[1:].tolist():
        parent, normal = int(net.parent[face]), outward(net, face)
        # What is left after the arc shows half in the plane of the parent and half in that of the child.
        left = deduction[face] + float((shifts[face] - shifts[parent]) @ normal)
        slide = np.eye(4)
        slide[:2, 3] = 0.5 * left * normal
        start, end = (np.append(point, 0.0) for point in net.hinge(face))
        turn = rotation_about_line(start, end, float(angles_rad[net.crease_of[face]]))
        pose[face] = pose[parent] @ slide @ turn @ slide
    flat = np.zeros((len(net.faces), 3, 3))
    flat[:, :, :2] = net.vertices[net.faces]
    bent: NDArray[np.float64] = np.einsum("fij,fkj->fki", pose[:, :3, :3], flat) + pose[:, None, :3, 3]
    return bent


def _check_lengths(width_mm: float, shift_mm: float) -> None:
    if not (np.isfinite(width_mm) and width_mm >= 0.0 and np.isfinite(shift_mm) and shift_mm >= 0.0):
        raise ValueError(
            f"bend width {width_mm} mm and neutral shift {shift_mm} mm must be finite and not negative"
        )
