"""A camera as a gauge: pictures in, the fold angle of a crease out."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.net import Net
from rigs.camera_file import CameraFile
from rigs.errors import JobError, MachineError
from rigs.hinge_fit import fit_hinge
from rigs.tag_layout import hinge_of
from rigs.tag_pictures import find_tags, grey_picture, need_cv2, picture_fault

__all__ = ["CameraGauge", "open_pictures"]

Picture = NDArray[np.uint8]

_WIDEST_DEG = 5.0
_SETTLE = 3  # pictures that a camera may still hold from before
_KINDS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")


class CameraGauge:
    """A ``rigs.measuring.Measure`` that looks at tags on the faces beside the crease.

    Args:
        net: of the part.
        file: camera and tags.
        take: takes a picture; ``open_pictures`` opens what the file names.
    """

    def __init__(self, net: Net, file: CameraFile, take: Callable[[], NDArray[np.uint8]]) -> None:
        self.net, self.file, self.take = net, file, take
        self.lens, self.tags = file.lens, file.placed

    def __call__(self, crease: int, expected_deg: float) -> tuple[float, float]:
        """Fold angle of a crease and its standard deviation, degrees.

        Raises:
            JobError: in words, if the pictures tell no angle.
            MachineError: if the camera gives no picture.
        """
        hinge = hinge_of(self.net, crease, self.tags)
        fits = []
        for _ in range(self.file.camera.pictures):
            picture = self._picture()
            seen = find_tags(picture, self.file.tags.family)
            try:
                fits.append(
                    fit_hinge(
                        seen, hinge, self.lens, math.radians(expected_deg),
                        corner_px=self.file.tags.corner_px, placed_mm=self.file.tags.placed_mm,
                    )
                )  # fmt: skip
            except JobError as error:
                fault = picture_fault(picture)
                why = f"{fault} ({error})" if fault else str(error)
                raise JobError(f"the camera cannot tell the angle of crease {crease}: {why}") from error
        angles = np.degrees([f.angle_rad for f in fits])
        sigma = math.degrees(math.sqrt(np.mean([f.sigma_rad**2 for f in fits])))
        if float(angles.max() - angles.min()) > 4.0 * sigma + 0.5:
            raise JobError(
                f"the camera cannot tell the angle of crease {crease}: it says {angles.min():.1f}° to "
                f"{angles.max():.1f}°: wait until the part rests"
            )
        if sigma > _WIDEST_DEG:
            raise JobError(
                f"the camera tells the angle of crease {crease} to ±{sigma:.1f}° only: come nearer, or look "
                "more from the side"
            )
        return float(np.median(angles)), sigma

    def _picture(self) -> Picture:
        picture = grey_picture(self.take())
        width, height = self.file.camera.size_px
        if picture.shape != (height, width):
            have = f"{picture.shape[1]} x {picture.shape[0]}"
            raise JobError(f"the camera gives {have} pixels, its calibration is for {width} x {height}")
        return picture


def open_pictures(source: str, *, timeout_s: float = 5.0) -> Callable[[], NDArray[np.uint8]]:
    """A function that takes pictures: from a camera by number, a URL, a picture, or the newest of a folder.

    Raises:
        JobError: if OpenCV is missing.
        MachineError: if there is nothing to open.
    """
    need_cv2()
    path = Path(source)
    if not source.isdigit() and "://" not in source:
        if not path.exists():
            raise MachineError(f"{source}: no camera, picture or folder of this name")
        return lambda: _read(_newest(path))
    return _stream(int(source) if source.isdigit() else source, timeout_s)


def _stream(source: int | str, timeout_s: float) -> Callable[[], NDArray[np.uint8]]:
    import cv2

    device: Any = cv2.VideoCapture(source)
    if not device.isOpened():
        raise MachineError(f"camera {source}: cannot be opened: plugged in, free, and the number right?")
    device.set(cv2.CAP_PROP_BUFFERSIZE, 1)

    def take() -> NDArray[np.uint8]:
        until = time.monotonic() + timeout_s
        good = 0
        while time.monotonic() < until:
            there, frame = device.read()
            good += bool(there)
            if good > _SETTLE:
                return np.asarray(frame, dtype=np.uint8)
        raise MachineError(f"camera {source}: no picture for {timeout_s:g} s")

    return take


def _newest(path: Path) -> Path:
    if path.is_file():
        return path
    found: Iterable[Path] = (p for p in path.iterdir() if p.suffix.lower() in _KINDS)
    newest = max(found, key=lambda p: (p.stat().st_mtime_ns, p.name), default=None)
    if newest is None:
        raise MachineError(f"{path}: no picture in it ({', '.join(_KINDS)})")
    return newest


def _read(path: Path) -> NDArray[np.uint8]:
    import cv2

    try:
        data = np.fromfile(path, dtype=np.uint8)
    except OSError as error:
        raise MachineError(f"{path}: cannot be read: {error.strerror or error}") from error
    picture = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE) if data.size else None
    if picture is None:
        raise MachineError(f"{path}: not a picture")
    return np.asarray(picture, dtype=np.uint8)
