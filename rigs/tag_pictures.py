"""Finding AprilTags in a picture, and saying why there are none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigs.errors import JobError
from rigs.tag_edges import sharpened_corners

__all__ = ["FAMILIES", "find_tags", "grey_picture", "picture_fault", "tag_bits"]

Picture = NDArray[np.uint8]

FAMILIES = ("16h5", "25h9", "36h10", "36h11")
_DARK, _BRIGHT = 40.0, 250.0
_CELL, _SHARP = 4, 0.5  # of the whole contrast, what the steepest edge rises within so many pixels


def need_cv2() -> None:
    """Say what to install where OpenCV is missing.

    Raises:
        JobError: if it is.
    """
    try:
        import cv2  # noqa: F401
    except ImportError as error:
        raise JobError("a camera needs OpenCV: pip install 'metal-blossom[camera]'") from error


def find_tags(picture: Picture, family: str = "36h11") -> dict[int, NDArray[np.float64]]:
    """Tags in a grey picture: number → (4, 2) corners in pixels, clockwise from the tag's own top left.

    A tag whose edges are not clear is left out, and a number that is seen twice: no one can tell which is
    which.
    """
    need_cv2()
    import cv2

    settings = cv2.aruco.DetectorParameters()
    settings.minMarkerPerimeterRate = 0.01
    dictionary = _dictionary(family)
    detector = cv2.aruco.ArucoDetector(dictionary, settings)
    corners, numbers, _ = detector.detectMarkers(picture)
    cells = dictionary.markerSize + 2
    found: dict[int, NDArray[np.float64]] = {}
    numbers_seen: set[int] = set()
    twice: set[int] = set()
    for number, quad in zip([] if numbers is None else numbers.ravel().tolist(), corners, strict=True):
        if number in numbers_seen:
            twice.add(number)
        numbers_seen.add(number)
        sharp = sharpened_corners(picture, np.asarray(quad, dtype=np.float64).reshape(4, 2), cells)
        if sharp is not None:
            found[number] = sharp
    return {n: c for n, c in found.items() if n not in twice}


def tag_bits(number: int, family: str = "36h11") -> NDArray[np.bool_]:
    """(N, N) cells of a tag, its black border included; True is white."""
    need_cv2()
    import cv2

    dictionary = _dictionary(family)
    if not 0 <= number < len(dictionary.bytesList):
        raise JobError(f"tag {number}: family {family} has the numbers 0 to {len(dictionary.bytesList) - 1}")
    cells = dictionary.markerSize + 2
    bits: NDArray[np.bool_] = np.asarray(cv2.aruco.generateImageMarker(dictionary, number, cells)) > 127
    return bits


def grey_picture(picture: NDArray[np.uint8]) -> Picture:
    """A picture of one or three channels as grey.

    Raises:
        JobError: if it is no picture.
    """
    if picture.ndim == 3 and picture.shape[2] in (3, 4):
        need_cv2()
        import cv2

        code = cv2.COLOR_BGR2GRAY if picture.shape[2] == 3 else cv2.COLOR_BGRA2GRAY
        return np.asarray(cv2.cvtColor(picture, code), dtype=np.uint8)
    if picture.ndim != 2 or picture.dtype != np.uint8 or not picture.size:
        raise JobError(
            f"a picture of shape {picture.shape} and {picture.dtype}: expected 8-bit grey or colour"
        )
    return picture


def picture_fault(picture: Picture) -> str:
    """What is wrong with a picture in which tags are missing, in words; empty if nothing is plain to see."""
    low, high = np.percentile(picture, (1.0, 99.0))
    if high < _DARK:
        return "the picture is dark: light, or a longer exposure"
    if low > _BRIGHT or float((picture >= 254).mean()) > 0.5:
        return "the picture is over-exposed: less light, or a shorter exposure"
    rows, columns = (n // _CELL * _CELL for n in picture.shape)
    coarse = picture[:rows, :columns].reshape(rows // _CELL, _CELL, columns // _CELL, _CELL).mean(axis=(1, 3))
    steps = np.concatenate([np.abs(np.diff(coarse, axis=k)).ravel() for k in (0, 1)])
    if float(np.percentile(steps, 99.9)) < _SHARP * float(high - low):
        return "the picture is blurred: focus, or a shorter exposure"
    return ""


def _dictionary(family: str) -> "cv2.aruco.Dictionary":  # type: ignore[name-defined]  # noqa: F821, UP037
    import cv2

    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_APRILTAG_{family.upper()}"))
