"""Strict reader of Object File Format (OFF) text files: positions and faces only."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.errors import MeshError
from planner.raw_mesh import MOST_FACES, RawMesh, file_error

__all__ = ["read_off"]

_EXPORT_AGAIN = "export the mesh again"


def read_off(data: bytes, source: str) -> RawMesh:
    """Read the content of an OFF file (``OFF`` or ``COFF`` header; colours are passed over).

    Raises:
        MeshError: no OFF header, lines missing, a word that is no number, an index that no vertex has.
    """
    if not data.strip():
        raise file_error(source, f"the file is empty ({len(data)} bytes)", _EXPORT_AGAIN)
    if b"\0" in data:
        raise file_error(source, "binary content, expected an OFF text file", _EXPORT_AGAIN)
    rows = _rows(data.decode("utf-8-sig", errors="replace"))
    number, words = next(rows, (1, [""]))
    if words[0].upper() not in ("OFF", "COFF"):
        raise file_error(
            source, f"line {number}: expected 'OFF', found {' '.join(words)[:40]!r}", _EXPORT_AGAIN
        )
    if len(words) == 1:
        number, words = next(rows, (number, []))
    else:
        words = words[1:]
    counts = _integers(words[:2], number, source)
    if len(counts) < 2 or min(counts) < 0:
        raise file_error(source, f"line {number}: expected the numbers of vertices and faces", _EXPORT_AGAIN)
    if max(counts) > MOST_FACES:
        raise file_error(
            source,
            f"line {number} announces {max(counts)} elements, more than the {MOST_FACES} that can be read",
            "the file is damaged or the mesh must be reduced first",
        )
    vertices, corners, sizes, lines = [], [], [], []
    for _ in range(counts[0]):
        number, words = next(rows, (number, []))
        try:
            x, y, z = (float(w) for w in words[:3])
        except ValueError:
            raise _missing(source, number, "three coordinates", words) from None
        vertices.append((x, y, z))
    for face in range(counts[1]):
        number, words = next(rows, (number, []))
        size = _integers(words[:1], number, source)
        indices = _integers(words[1 : 1 + size[0]], number, source) if size else []
        if not size or len(indices) != size[0]:
            raise _missing(source, number, "a count and as many vertex numbers", words)
        if min(indices, default=0) < 0 or max(indices, default=0) >= counts[0]:
            raise file_error(
                source,
                f"face {face + 1} (line {number}) refers to vertex {max(indices)} of {counts[0]} "
                "(counted from 0)",
                f"the file is damaged, {_EXPORT_AGAIN}",
            )
        corners.extend(indices)
        sizes.append(size[0])
        lines.append(number)
    if not sizes:
        raise file_error(source, f"{counts[0]} vertices but no faces", "export the mesh with its faces")
    return RawMesh(
        source,
        np.array(vertices, dtype=np.float64).reshape(-1, 3),
        np.array(corners, dtype=np.int64),
        np.array(sizes, dtype=np.int64),
        np.array(lines, dtype=np.int64),
    )


def _rows(text: str) -> Iterator[tuple[int, list[str]]]:
    """Numbered lines that say something, as words, comments left out."""
    for number, line in enumerate(text.split("\n"), 1):
        words = line.split("#", 1)[0].split()
        if words:
            yield number, words


def _integers(words: list[str], number: int, source: str) -> list[int]:
    """Whole numbers of a line."""
    try:
        return [int(w) for w in words]
    except ValueError:
        raise _missing(source, number, "whole numbers", words) from None


def _missing(source: str, number: int, wanted: str, words: list[str]) -> MeshError:
    """The error for a line that does not hold what it should."""
    found = repr(" ".join(words)[:40]) if words else "the end of the file"
    return file_error(source, f"line {number}: expected {wanted}, found {found}", _EXPORT_AGAIN)
