"""Pictures of a folded part with tags on it, by casting a ray through every point of every pixel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.kinematics import face_transforms
from planner.net import Net
from rigs.hinge_fit import Lens
from rigs.tag_layout import QUIET_CELLS, Tag
from rigs.tag_pictures import tag_bits

__all__ = ["Scene", "View", "part_picture", "view_of_crease"]

Array = NDArray[np.float64]

_METAL, _PAPER, _INK, _GROUND = 0.55, 0.92, 0.05, 0.25


@dataclass(frozen=True, eq=False)
class View:
    """A camera and where it stands.

    Attributes:
        lens: its calibration.
        size_px: width and height.
        turn: (3, 3) rotation from the frame of the net to that of the camera.
        move: (3,) then this shift, mm.
    """

    lens: Lens
    size_px: tuple[int, int]
    turn: Array
    move: Array


@dataclass(frozen=True)
class Scene:
    """How the picture comes out.

    Attributes:
        brightness: of everything, 1 is well exposed.
        noise: standard deviation of a pixel, of 255 levels.
        blur_px: standard deviation of the blur.
        rays: rays of a pixel in each direction.
        family: of the tags.
        seed: of the noise.
    """

    brightness: float = 1.0
    noise: float = 2.0
    blur_px: float = 0.6
    rays: int = 3
    family: str = "36h11"
    seed: int = 0


def part_picture(
    net: Net,
    angles_rad: Array,
    tags: Sequence[Tag],
    view: View,
    scene: Scene = Scene(),
    *,
    faces: Sequence[int] | None = None,
) -> NDArray[np.uint8]:
    """Grey picture of the net at given fold angles; nearer faces hide farther ones.

    Args:
        net: the net; its base face stands in the frame of the net.
        angles_rad: (E,) fold angle of every edge.
        tags: on its faces.
        view: the camera.
        scene: light, noise and blur.
        faces: only these are drawn.

    Returns:
        (height, width) of 8 bits.
    """
    from scipy.ndimage import gaussian_filter

    width, height = view.size_px
    n = scene.rays
    directions = _directions(view, n)
    depth = np.full((height * n, width * n), np.inf)
    light = np.full((height * n, width * n), _GROUND)
    carried: dict[int, list[Tag]] = {}
    for tag in tags:
        carried.setdefault(tag.face, []).append(tag)
    transforms = face_transforms(net, np.asarray(angles_rad, dtype=np.float64))
    for face in range(len(net.faces)) if faces is None else faces:
        turn = view.turn @ transforms[face, :3, :3]
        move = view.turn @ transforms[face, :3, 3] + view.move
        corners = net.vertices[net.faces[face]]
        _draw(corners, carried.get(face, []), turn, move, directions, depth, light, scene, view)
    picture = light.reshape(height, n, width, n).mean(axis=(1, 3)) * 255.0 * scene.brightness
    if scene.blur_px > 0.0:
        picture = gaussian_filter(picture, scene.blur_px)
    if scene.noise > 0.0:
        picture = picture + np.random.default_rng(scene.seed).normal(0.0, scene.noise, picture.shape)
    out: NDArray[np.uint8] = np.clip(np.round(picture), 0.0, 255.0).astype(np.uint8)
    return out


def view_of_crease(
    net: Net,
    angles_rad: Array,
    crease: int,
    lens: Lens,
    size_px: tuple[int, int],
    *,
    away_mm: float,
    lean: tuple[float, float] = (0.0, 0.0),
    roll_rad: float = 0.0,
    side: float = 1.0,
) -> View:
    """A camera that looks at the middle of a crease, from between the normals of its two faces.

    Args:
        net: the net; ``angles_rad`` its fold angles.
        angles_rad: (E,) fold angle of every edge.
        crease: net edge.
        lens: the camera.
        size_px: width and height.
        away_mm: distance.
        lean: angles (rad) by which it leans, along and across the crease.
        roll_rad: turn about its own axis.
        side: +1 looks at the top of the sheet, -1 at its bottom.
    """
    transforms = face_transforms(net, np.asarray(angles_rad, dtype=np.float64))
    child = net.child_of[crease]
    parent = int(net.parent[child])
    start, end = (transforms[child, :3, :2] @ p + transforms[child, :3, 3] for p in net.hinge(child))
    along = (end - start) / np.linalg.norm(end - start)
    up = side * (transforms[child, :3, 2] + transforms[parent, :3, 2])
    if np.linalg.norm(up) < 1e-9:
        up = np.cross(along, transforms[child, :3, 2])
    up = up / np.linalg.norm(up)
    across = np.cross(up, along)
    back = np.cos(lean[0]) * np.cos(lean[1]) * up + np.sin(lean[0]) * along
    back = back + np.cos(lean[0]) * np.sin(lean[1]) * across
    right = np.cross(np.cos(roll_rad) * across - np.sin(roll_rad) * along, back)
    right = right / np.linalg.norm(right)
    turn = np.stack([right, np.cross(-back, right), -back])
    return View(lens, size_px, turn, -turn @ (0.5 * (start + end) + away_mm * back))


def _directions(view: View, n: int) -> Array:
    """(height n, width n, 3) directions of the rays; the middle of the first pixel is (0, 0)."""
    width, height = view.size_px
    offsets = (np.arange(n) + 0.5) / n - 0.5
    u = (np.arange(width)[:, None] + offsets).ravel()
    v = (np.arange(height)[:, None] + offsets).ravel()
    inverse = np.linalg.inv(view.lens.matrix)
    x = inverse[0, 0] * u[None, :] + inverse[0, 1] * v[:, None] + inverse[0, 2]
    y = inverse[1, 1] * v[:, None] + inverse[1, 2] + 0.0 * u[None, :]
    distortion = view.lens.distortion
    if np.any(distortion != 0.0):
        k1, k2, p1, p2, k3 = distortion.tolist()
        x0, y0 = x, y
        for _ in range(12):  # the inverse of the distortion has no closed form
            r2 = x * x + y * y
            radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
            dx = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
            dy = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
            x, y = (x0 - dx) / radial, (y0 - dy) / radial
    return np.stack([x, y, np.ones_like(x)], axis=2)


def _draw(
    corners: Array,
    tags: Sequence[Tag],
    turn: Array,
    move: Array,
    directions: Array,
    depth: Array,
    light: Array,
    scene: Scene,
    view: View,
) -> None:
    """Draw one face into ``depth`` and ``light``."""
    n = scene.rays
    points = np.column_stack([corners, np.zeros(3)]) @ turn.T + move
    if (points[:, 2] <= 1e-6).any():
        return
    low, high = view.lens.project(points).min(axis=0), view.lens.project(points).max(axis=0)
    shape = depth.shape
    x0, y0 = (max(int(np.floor(v - 2.0)) * n, 0) for v in low)
    x1, y1 = (min((int(np.ceil(v)) + 3) * n, s) for v, s in zip(high, shape[::-1], strict=True))
    if x0 >= x1 or y0 >= y1:
        return
    rays = directions[y0:y1, x0:x1]
    normal = turn[:, 2]
    slope = rays @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        z = (move @ normal) / slope
    place = (rays * z[..., None] - move) @ turn[:, :2]  # coordinates in the flat sheet
    inside = np.isfinite(z) & (z > 0.0)
    for k in range(3):
        a, b = corners[k], corners[(k + 1) % 3]
        inside &= (b[0] - a[0]) * (place[..., 1] - a[1]) - (b[1] - a[1]) * (place[..., 0] - a[0]) >= 0.0
    inside &= z < depth[y0:y1, x0:x1]
    seen = "top" if move @ normal < 0.0 else "bottom"
    shade = 0.55 + 0.45 * abs(float(normal[2]))
    colour = np.full(inside.shape, _METAL * shade)
    for tag in tags:
        if tag.side == seen:
            _print(tag, place, colour, shade, scene.family)
    depth[y0:y1, x0:x1][inside] = z[inside]
    light[y0:y1, x0:x1][inside] = colour[inside]


def _print(tag: Tag, place: Array, colour: Array, shade: float, family: str) -> None:
    """Put the cells of a tag and its white frame into ``colour``."""
    bits = tag_bits(tag.number, family)
    cells = len(bits)
    top_left, top_right, _, bottom_left = tag.corners_mm
    right, down = top_right - top_left, bottom_left - top_left
    u = ((place - top_left) @ right) / (right @ right) * cells
    v = ((place - top_left) @ down) / (down @ down) * cells
    inside = (u >= -QUIET_CELLS) & (u < cells + QUIET_CELLS) & (v >= -QUIET_CELLS) & (v < cells + QUIET_CELLS)
    on_tag = inside & (u >= 0.0) & (u < cells) & (v >= 0.0) & (v < cells)
    colour[inside] = _PAPER * shade
    rows, columns = np.clip(v[on_tag].astype(int), 0, cells - 1), np.clip(u[on_tag].astype(int), 0, cells - 1)
    colour[on_tag] = np.where(bits[rows, columns], _PAPER, _INK) * shade
