"""The file of a camera that measures fold angles: its calibration, where pictures come from, and the tags."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from rigs.errors import ProfileError
from rigs.hinge_fit import Lens
from rigs.profile_text import parse_profile
from rigs.rig import Profile
from rigs.tag_layout import Tag
from rigs.tag_pictures import FAMILIES

__all__ = ["CameraFile", "camera_text", "read_camera"]

Triple = tuple[float, float, float]


class CameraTable(Profile, frozen=True, kw_only=True):
    """``[camera]``: where pictures come from, and the calibration as OpenCV gives it.

    Attributes:
        source: number of a camera of this computer, a URL of a stream, a picture, or a folder whose newest
            picture is taken.
        size_px: width and height that the calibration holds for.
        matrix: camera matrix, pixels.
        distortion: k1, k2, p1, p2, k3.
        pictures: taken for one reading.
    """

    source: str
    size_px: tuple[int, int]
    matrix: tuple[Triple, Triple, Triple]
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    pictures: int = 3


class TagsTable(Profile, frozen=True, kw_only=True):
    """``[tags]``: what holds for all tags.

    Attributes:
        family: of the AprilTags.
        placed_mm: standard deviation of the place of a tag on its face.
        corner_px: standard deviation of a corner in the picture.
    """

    family: str = "36h11"
    placed_mm: float = 0.05
    corner_px: float = 0.1


class TagTable(Profile, frozen=True, kw_only=True):
    """``[[tag]]``: one tag; see ``rigs.tag_layout.Tag``."""

    number: int
    face: int
    centre_mm: tuple[float, float]
    size_mm: float
    turned_deg: float = 0.0
    side: Literal["top", "bottom"] = "top"


class CameraFile(Profile, frozen=True, kw_only=True):
    """A camera and the tags that it looks at."""

    schema: Literal[1]
    camera: CameraTable
    tags: TagsTable = TagsTable()
    tag: tuple[TagTable, ...]

    @property
    def lens(self) -> Lens:
        """The calibration."""
        return Lens(np.array(self.camera.matrix), np.array(self.camera.distortion))

    @property
    def placed(self) -> tuple[Tag, ...]:
        """The tags."""
        return tuple(Tag(t.number, t.face, t.centre_mm, t.size_mm, t.turned_deg, t.side) for t in self.tag)


def read_camera(path: Path, faces: int) -> CameraFile:
    """Read a camera file.

    Args:
        path: TOML.
        faces: of the net whose tags it lists.

    Raises:
        ProfileError: naming the place of the mistake.
    """
    try:
        text = path.read_text("utf-8")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ProfileError(f"{path}: cannot read the camera file: {reason}") from error
    return parse_profile(text, CameraFile, lambda file: _mistakes(file, faces), str(path))


def camera_text(
    tags: Sequence[Tag], *, family: str, source: str, size_px: tuple[int, int], lens: Lens
) -> str:
    """TOML of a camera file."""
    rows = ", ".join("[" + ", ".join(f"{v:g}" for v in row) + "]" for row in lens.matrix.tolist())
    lines = [
        "# A camera that measures fold angles. Put in the calibration of your camera (OpenCV's, in pixels).",
        "schema = 1", "",
        "[camera]", f'source = "{source}"', f"size_px = [{size_px[0]}, {size_px[1]}]", f"matrix = [{rows}]",
        f"distortion = [{', '.join(f'{v:g}' for v in lens.distortion.tolist())}]", "",
        "[tags]", f'family = "{family}"', "placed_mm = 0.05",
    ]  # fmt: skip
    for t in tags:
        lines += [
            "", "[[tag]]", f"number = {t.number}", f"face = {t.face}",
            f"centre_mm = [{t.centre_mm[0]:.3f}, {t.centre_mm[1]:.3f}]", f"size_mm = {t.size_mm:.3f}",
            f"turned_deg = {t.turned_deg:g}", f'side = "{t.side}"',
        ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _mistakes(file: CameraFile, faces: int) -> Iterator[str]:
    """What is wrong with values of the right types."""
    (fx, _, _), (zero, fy, _), last = file.camera.matrix
    if fx <= 0.0 or fy <= 0.0 or zero != 0.0 or last != (0.0, 0.0, 1.0):
        yield "$.camera.matrix: expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with fx, fy above 0"
    if min(file.camera.size_px) < 16:
        yield "$.camera.size_px: expected the width and height of a picture, 16 or more"
    if not 1 <= file.camera.pictures <= 50:
        yield "$.camera.pictures: expected 1 to 50"
    if file.tags.family not in FAMILIES:
        yield f"$.tags.family: expected one of {', '.join(FAMILIES)}"
    if not 0.0 <= file.tags.placed_mm <= 5.0 or not 0.001 <= file.tags.corner_px <= 5.0:
        yield "$.tags: expected placed_mm from 0 to 5 and corner_px from 0.001 to 5"
    seen: set[int] = set()
    for k, tag in enumerate(file.tag):
        if tag.number in seen:
            yield f"$.tag[{k}].number: tag {tag.number} is listed twice"
        seen.add(tag.number)
        if not 0 <= tag.face < faces:
            yield f"$.tag[{k}].face: the net has faces 0 to {faces - 1}"
        if not (tag.size_mm > 0.0 and math.isfinite(tag.size_mm)):
            yield f"$.tag[{k}].size_mm: expected the side of the black square, mm"
