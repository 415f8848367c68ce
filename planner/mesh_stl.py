"""Strict reader of binary and ASCII STL files."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from planner.raw_mesh import MOST_FACES, RawMesh, file_error

__all__ = ["read_stl"]

_HEADER_BYTES = 84
_FACET_BYTES = 50
_EXPORT_AGAIN = "export the mesh again"


def read_stl(data: bytes, source: str) -> RawMesh:
    """Read the content of an STL file.

    A file whose length fits its facet count is binary, whatever its header says; else a file that starts
    with ``solid`` is text.

    Raises:
        MeshError: the file is empty, cut off, lies about its facet count, or is no STL.
    """
    if not data:
        raise file_error(source, "the file is empty (0 bytes)", _EXPORT_AGAIN)
    announced = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER_BYTES else -1
    if announced >= 0 and len(data) == _HEADER_BYTES + _FACET_BYTES * announced:
        return _read_binary(data, announced, source)
    if data.lstrip()[:5].lower() == b"solid" and b"\0" not in data:
        return _read_ascii(data.decode("latin-1"), source)
    if announced < 0:
        raise file_error(source, f"{len(data)} bytes are too few for an STL file", _EXPORT_AGAIN)
    held = (len(data) - _HEADER_BYTES) / _FACET_BYTES
    raise file_error(
        source,
        f"not a whole STL file: the header announces {announced} facets, the {len(data)} bytes hold "
        f"{held:.1f}",
        f"the file is cut off, damaged or no STL, {_EXPORT_AGAIN}",
    )


def _read_binary(data: bytes, count: int, source: str) -> RawMesh:
    """Read ``count`` facets; the length of ``data`` was checked to fit."""
    if count == 0:
        raise file_error(source, "the STL file has no facets", "export a mesh that has faces")
    if count > MOST_FACES:
        raise file_error(
            source,
            f"{count} faces are more than the {MOST_FACES} that can be read",
            "reduce the mesh in a modelling program first",
        )
    record = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])
    facets = np.frombuffer(data, dtype=record, offset=_HEADER_BYTES, count=count)
    vertices: NDArray[np.float64] = facets["corner"].astype(np.float64).reshape(-1, 3)
    return RawMesh(source, vertices, *_soup_indices(count), soup=True, single_precision=True)


def _read_ascii(text: str, source: str) -> RawMesh:
    """Read the text form: every facet is checked word by word."""
    coordinates: list[tuple[float, float, float]] = []
    lines: list[int] = []
    expected = "facet"
    inside = False
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if not words:
            continue
        key = words[0].lower()
        if key == "solid" and not inside:
            inside = True
        elif key == "endsolid" and inside and expected == "facet":
            inside = False
        elif not inside or key != expected.split(" ")[0]:
            wanted = f"'{expected.split(' ')[0]}'" if inside else "'solid'"
            found = repr(line.strip()[:40])
            raise file_error(source, f"line {number}: expected {wanted}, found {found}", _EXPORT_AGAIN)
        elif key == "facet":
            lines.append(number)
            expected = "outer"
        elif key == "outer":
            expected = "vertex 1"
        elif key == "vertex":
            coordinates.append(_three_numbers(words, number, source))
            corner = int(expected[-1])
            expected = f"vertex {corner + 1}" if corner < 3 else "endloop"
        elif key == "endloop":
            expected = "endfacet"
        else:
            expected = "facet"
    if inside:
        missing = "endsolid" if expected == "facet" else expected.split(" ")[0]
        raise file_error(
            source,
            f"the text ends after {len(lines)} facets without '{missing}'",
            f"the file is cut off, {_EXPORT_AGAIN}",
        )
    if not lines:
        raise file_error(source, "the STL file has no facets", "export a mesh that has faces")
    return RawMesh(
        source, np.array(coordinates), *_soup_indices(len(lines)), lines=np.array(lines), soup=True
    )


def _three_numbers(words: list[str], number: int, source: str) -> tuple[float, float, float]:
    """The coordinates of one vertex line."""
    try:
        x, y, z = (float(w) for w in words[1:])
    except ValueError:
        shown = " ".join(words)[:60]
        comma = re.search(r"\d,\d", shown)
        cure = "write decimal points, not commas" if comma else _EXPORT_AGAIN
        raise file_error(source, f"line {number}: expected three numbers, found '{shown}'", cure) from None
    return x, y, z


def _soup_indices(count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Corners and sizes of ``count`` triangles that share no vertex."""
    return np.arange(3 * count, dtype=np.int64), np.full(count, 3, dtype=np.int64)
