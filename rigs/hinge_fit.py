"""The fold angle of a crease from one picture of tags on the two faces beside it, and how sure it is.

One fit for everything: where the part is, the fold angle about the known crease, and how far every tag lies
beside the place where it should. The standard deviation comes from that fit, so it knows how well the camera
sees the two faces.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigs.errors import JobError

__all__ = ["Hinge", "HingeFit", "Lens", "fit_hinge"]

Array = NDArray[np.float64]

_ROUNDS = 60
_WORST_MISFIT = 4.0  # root of chi squared per degree of freedom: beyond it the tags are not where they should
_RIVAL = 9.0  # minima whose chi squared is within this of the best cannot be told from it
_RIVAL_RAD = math.radians(2.0)
_NEAR_RAD = math.radians(20.0)  # the expected angle tells minima apart that are farther away than this
_FLOOR_RAD = math.radians(0.1)


@dataclass(frozen=True, eq=False)
class Lens:
    """A calibrated camera: pinhole with radial and tangential distortion, as OpenCV calibrates it.

    Attributes:
        matrix: (3, 3) camera matrix, pixels; the middle of the first pixel is (0, 0).
        distortion: k1, k2, p1, p2, k3.
    """

    matrix: Array
    distortion: Array

    def project(self, points: Array) -> Array:
        """(N, 2) pixels of (N, 3) points in the frame of the camera (z into the picture)."""
        k1, k2, p1, p2, k3 = self.distortion.tolist()
        x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        u = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        v = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        plane: Array = np.stack([u, v, np.ones_like(u)], axis=1) @ self.matrix[:2].T
        return plane


@dataclass(frozen=True, eq=False)
class Hinge:
    """A crease in the flat sheet and the tags on its two sides.

    Attributes:
        start: (2,) first end; turning by a positive angle about ``end - start`` is a valley fold.
        end: (2,) other end.
        fixed: number of a tag → its (4, 2) corners in the flat, on the side that stays, mm.
        turning: the same on the side that turns.
    """

    start: Array
    end: Array
    fixed: Mapping[int, Array]
    turning: Mapping[int, Array]


@dataclass(frozen=True)
class HingeFit:
    """What a picture says.

    Attributes:
        angle_rad: fold angle with its sign.
        sigma_rad: standard deviation.
        misfit: root of chi squared per degree of freedom; about 1 or less when all is as assumed.
    """

    angle_rad: float
    sigma_rad: float
    misfit: float


def fit_hinge(
    seen: Mapping[int, Array],
    hinge: Hinge,
    lens: Lens,
    expected_rad: float,
    *,
    corner_px: float = 0.1,
    placed_mm: float = 0.05,
) -> HingeFit:
    """Fold angle from the corners of tags in a picture.

    Args:
        seen: number of a tag → its (4, 2) corners in the picture, in the order of the tag.
        hinge: the crease and its tags; tags of others in ``seen`` do not matter.
        lens: the camera.
        expected_rad: what the angle should be about: it only decides where the picture allows two angles.
        corner_px: standard deviation of a corner in the picture.
        placed_mm: standard deviation of the place of a tag on the sheet.

    Raises:
        JobError: if a side has no tag, tags are not where they should be, or the picture allows two angles.
    """
    parts = [{n: c for n, c in side.items() if n in seen} for side in (hinge.fixed, hinge.turning)]
    for side, found, name in zip((hinge.fixed, hinge.turning), parts, ("stays", "turns"), strict=True):
        if not found:
            wanted = ", ".join(str(n) for n in sorted(side)) or "none is placed there"
            have = ", ".join(str(n) for n in sorted(seen)) or "none"
            raise JobError(f"no tag on the side that {name} (expected {wanted}; seen: {have})")
    problem = _Problem(hinge, parts[0], parts[1], seen, lens, corner_px, placed_mm)
    minima = _distinct([m for start in problem.starts(expected_rad) if (m := problem.solve(start))])
    if not minima:
        raise JobError("the tags in the picture do not fit any angle of the crease")
    best = minima[0]
    freedom = 8 * (len(parts[0]) + len(parts[1])) - 7
    misfit = math.sqrt(best.chi2 / freedom)
    if misfit > _WORST_MISFIT:
        raise JobError(
            f"the tags are not where they should be on the two faces ({best.rms_px:.1f} px off): "
            "wrong tag, wrong place, or the camera is not calibrated"
        )
    rivals = [m for m in minima if m.chi2 < best.chi2 + _RIVAL * max(1.0, misfit**2)]
    near = [m for m in rivals if abs(_wrapped(m.angle - expected_rad)) < _NEAR_RAD] or rivals
    if len(near) > 1:
        angles = " and ".join(f"{math.degrees(m.angle):.0f}°" for m in near[:2])
        raise JobError(f"the picture allows {angles}: turn the camera, or come nearer")
    chosen = near[0]
    own = math.sqrt(chosen.chi2 / freedom) * (1.0 + 1.4 / freedom)  # so few corners: Student's t
    sigma = max(chosen.sigma * max(1.0, own), _FLOOR_RAD)
    return HingeFit(chosen.angle, sigma, math.sqrt(chosen.chi2 / freedom))


@dataclass(frozen=True)
class _Minimum:
    angle: float
    sigma: float
    chi2: float
    rms_px: float


class _Problem:
    """Residuals over (pose 6, angle, and per tag its place: along, across, turn)."""

    def __init__(
        self,
        hinge: Hinge,
        fixed: Mapping[int, Array],
        turning: Mapping[int, Array],
        seen: Mapping[int, Array],
        lens: Lens,
        corner_px: float,
        placed_mm: float,
    ) -> None:
        self.start = np.append(hinge.start, 0.0)
        axis = np.append(hinge.end - hinge.start, 0.0)
        self.axis = axis / np.linalg.norm(axis)
        self.sides = (fixed, turning)
        self.flat = np.array([*fixed.values(), *turning.values()])  # (T, 4, 2)
        self.turns = np.array([False] * len(fixed) + [True] * len(turning))
        self.middle = self.flat.mean(axis=1, keepdims=True)
        self.pixels = np.array([seen[n] for n in (*fixed, *turning)], dtype=np.float64)
        self.lens, self.corner_px, self.placed_mm = lens, corner_px, placed_mm
        self.size_mm = float(np.linalg.norm(self.flat[:, 0] - self.flat[:, 1], axis=1).mean())
        self.seen = seen

    def points(self, x: Array) -> Array:
        """(B, T, 4, 3) corners in the frame of the camera, for (B, N) parameters."""
        moves = x[:, 7:].reshape(len(x), -1, 3) * (1.0, 1.0, 1.0 / self.size_mm) * self.placed_mm
        rel = self.flat - self.middle
        cos, sin = np.cos(moves[..., 2])[..., None], np.sin(moves[..., 2])[..., None]
        places = np.zeros((*moves.shape[:2], 4, 3))
        places[..., 0] = cos * rel[..., 0] - sin * rel[..., 1]
        places[..., 1] = sin * rel[..., 0] + cos * rel[..., 1]
        places[..., :2] += self.middle + moves[:, :, None, :2]
        turn = _rotations(self.axis * x[:, 6:7])
        turned = np.einsum("bij,btkj->btki", turn, places[:, self.turns] - self.start) + self.start
        places[:, self.turns] = turned
        out: Array = np.einsum("bij,btkj->btki", _rotations(x[:, :3]), places) + x[:, None, None, 3:6]
        return out

    def residuals(self, x: Array) -> Array:
        """(B, 11 T) misfits of the corners and of the places, in standard deviations."""
        points = self.points(x)
        points[..., 2] = np.maximum(points[..., 2], 1e-3)
        pixels = self.lens.project(points.reshape(-1, 3)).reshape(len(x), -1)
        return np.concatenate([(pixels - self.pixels.ravel()) / self.corner_px, x[:, 7:]], axis=1)

    def starts(self, expected_rad: float) -> Iterator[Array]:
        """Where to begin: the two poses that a plane may have, for each side, and the expected angle."""
        poses = [self._poses(side) for side in self.sides]
        places = np.zeros(3 * len(self.flat))
        for turn_a, move_a in poses[0]:
            yield np.concatenate([_vector(turn_a), move_a, [expected_rad], places])
            for turn_b, _ in poses[1]:
                angle = _about(turn_a.T @ turn_b, self.axis)
                yield np.concatenate([_vector(turn_a), move_a, [angle], places])
        for turn_b, move_b in poses[1]:  # the side that turns tells where the other one is
            back = _rotation(-self.axis * expected_rad)
            turn_a = turn_b @ back
            move_a = move_b + turn_b @ (self.start - back @ self.start)
            yield np.concatenate([_vector(turn_a), move_a, [expected_rad], places])

    def _poses(self, side: Mapping[int, Array]) -> list[tuple[Array, Array]]:
        import cv2

        flat = np.concatenate([np.array(c) for c in side.values()])
        places = np.column_stack([flat, np.zeros(len(flat))])
        pixels = np.concatenate([np.asarray(self.seen[n], dtype=np.float64) for n in side])
        _, turns, moves, _ = cv2.solvePnPGeneric(
            places, pixels, self.lens.matrix, self.lens.distortion, flags=cv2.SOLVEPNP_IPPE
        )
        return [(_rotation(np.ravel(t)), np.ravel(m)) for t, m in zip(turns, moves, strict=True)]

    def solve(self, start: Array) -> _Minimum | None:
        """The minimum next to a start, or None if it is none or its tags would show their backs."""
        if not np.isfinite(start).all():
            return None
        x, off, slope = self._descend(start)
        points = self.points(x[None])[0]
        if not np.isfinite(x).all() or (points[..., 2] <= 0.0).any() or not self._face_the_camera(points):
            return None
        try:
            sigma = math.sqrt(np.linalg.inv(slope.T @ slope)[6, 6])
        except (np.linalg.LinAlgError, ValueError):
            return None
        pixels = off[: self.pixels.size] * self.corner_px
        rms = math.sqrt(float((pixels**2).mean()) * 2.0)
        return _Minimum(_wrapped(float(x[6])), sigma, float((off**2).sum()), rms)

    def _descend(self, x: Array) -> tuple[Array, Array, Array]:
        """Levenberg-Marquardt: parameters, residuals and their slope at the minimum."""
        scale = np.full(len(x), 1e-6)
        damping = 1e-3
        off = self.residuals(x[None])[0]
        slope = self._slope(x, scale)
        for _ in range(_ROUNDS):
            square, force = slope.T @ slope, slope.T @ off
            moved = x - np.linalg.solve(square + damping * np.diag(np.diag(square) + 1e-12), force)
            now = self.residuals(moved[None])[0]
            gained = float(off @ off - now @ now)
            if not gained > 0.0:
                damping *= 8.0
                if damping > 1e9:
                    break
                continue
            x, off, damping = moved, now, max(damping / 6.0, 1e-12)
            slope = self._slope(x, scale)
            if gained < 1e-6 * (1.0 + float(off @ off)):
                break
        return x, off, slope

    def _slope(self, x: Array, scale: Array) -> Array:
        """(R, N) derivatives of the residuals by central differences."""
        steps = np.diag(scale)
        values = self.residuals(np.concatenate([x + steps, x - steps]))
        out: Array = ((values[: len(x)] - values[len(x) :]) / (2.0 * scale[:, None])).T
        return out

    def _face_the_camera(self, points: Array) -> bool:
        """Corners of a tag run the same way round in the picture as on the tag."""
        return all(_area(p[:, :2] / p[:, 2:]) > 0.0 for p in points)


def _distinct(minima: list[_Minimum]) -> list[_Minimum]:
    out: list[_Minimum] = []
    for m in sorted(minima, key=lambda m: m.chi2):
        if all(abs(_wrapped(m.angle - o.angle)) > max(_RIVAL_RAD, 3.0 * o.sigma) for o in out):
            out.append(m)
    return out


def _rotation(vector: Array) -> Array:
    turn: Array = _rotations(vector[None])[0]
    return turn


def _rotations(vectors: Array) -> Array:
    """(B, 3, 3) rotations about (B, 3) vectors by their lengths; Rodrigues' formula."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = (vectors / np.maximum(angle[:, 0], 1e-12)).T
    o = np.zeros_like(x)
    cross = np.stack([o, -z, y, z, o, -x, -y, x, o], axis=1).reshape(-1, 3, 3)
    turn: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    return turn


def _vector(turn: Array) -> Array:
    import cv2

    vector: Array = np.ravel(cv2.Rodrigues(turn)[0])
    return vector


def _about(turn: Array, axis: Array) -> float:
    """Angle of the rotation about ``axis`` that is nearest to ``turn``."""
    twist = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return math.atan2(float(twist @ axis), float(np.trace(turn) - axis @ turn @ axis))


def _wrapped(angle: float) -> float:
    return math.remainder(angle, 2.0 * math.pi)


def _area(p: Array) -> float:
    """Twice the signed area of a quadrilateral in the picture; positive for tag order (y points down)."""
    q = np.roll(p, -1, axis=0)
    return float((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum())
