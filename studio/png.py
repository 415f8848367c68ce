"""PNG and animated PNG files from arrays, by the PNG specification (third edition, W3C 2025)."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

__all__ = ["animated_png", "png"]

_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def png(image: NDArray[np.uint8]) -> bytes:
    """A picture (H, W, 3) as a PNG file."""
    return _SIGNATURE + _header(image) + _chunk(b"IDAT", _packed(image)) + _chunk(b"IEND", b"")


def animated_png(images: Iterable[NDArray[np.uint8]], per_second: int) -> bytes:
    """Pictures (H, W, 3) of one size as an animated PNG that runs once.

    Raises:
        ValueError: if there is no picture.
    """
    body, count, first = [], 0, None
    number = 0
    for image in images:
        first = image if first is None else first
        height, width = image.shape[:2]
        control = struct.pack(">IIIIIHHBB", number, width, height, 0, 0, 1, per_second, 0, 0)
        body.append(_chunk(b"fcTL", control))
        number += 1
        if count == 0:
            body.append(_chunk(b"IDAT", _packed(image)))
        else:
            body.append(_chunk(b"fdAT", struct.pack(">I", number) + _packed(image)))
            number += 1
        count += 1
    if first is None:
        raise ValueError("an animation needs at least one picture")
    control = _chunk(b"acTL", struct.pack(">II", count, 1))
    return b"".join([_SIGNATURE, _header(first), control, *body, _chunk(b"IEND", b"")])


def _header(image: NDArray[np.uint8]) -> bytes:
    height, width = image.shape[:2]
    return _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))


def _packed(image: NDArray[np.uint8]) -> bytes:
    """Rows with filter type 2 (difference to the row above), deflated."""
    rows = np.ascontiguousarray(image).reshape(len(image), -1)
    up = rows.copy()
    up[1:] -= rows[:-1]
    marked = np.concatenate([np.full((len(rows), 1), 2, dtype=np.uint8), up], axis=1)
    return zlib.compress(marked.tobytes(), 6)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
