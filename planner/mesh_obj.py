"""Strict reader of Wavefront OBJ files: positions and faces only."""

from __future__ import annotations

import re

import numpy as np

from planner.raw_mesh import MOST_FACES, RawMesh, file_error

__all__ = ["read_obj"]

_EXPORT_AGAIN = "export the mesh again"
_PASSED_OVER = frozenset({
    "vt", "vn", "vp", "l", "p", "o", "g", "s", "mg", "mtllib", "usemtl", "usemap", "maplib", "lod", "bevel",
    "c_interp", "d_interp", "shadow_obj", "trace_obj", "cstype", "deg", "bmat", "step", "curv", "curv2",
    "surf", "parm", "trim", "hole", "scrv", "sp", "end", "con", "ctech", "stech", "call", "csh",
})  # fmt: skip


def read_obj(data: bytes, source: str) -> RawMesh:
    """Read the content of an OBJ file; normals, textures, materials and groups are passed over.

    Raises:
        MeshError: no text, no faces, a coordinate that is no number, an index that no vertex has.
    """
    if not data.strip():
        raise file_error(source, f"the file is empty ({len(data)} bytes)", _EXPORT_AGAIN)
    if b"\0" in data:
        raise file_error(
            source, "binary content, an OBJ file is text", f"the file is damaged, {_EXPORT_AGAIN}"
        )
    text = data.decode("utf-8-sig", errors="replace")
    vertices: list[tuple[float, ...]] = []
    corners: list[int] = []
    sizes: list[int] = []
    lines: list[int] = []
    unknown: dict[str, int] = {}
    carried, first = "", 0
    for number, line in enumerate(text.split("\n"), 1):
        if line.rstrip().endswith("\\"):
            first = first or number
            carried += line.rstrip()[:-1] + " "
            continue
        whole, place = carried + line, first or number
        carried, first = "", 0
        words = whole.split("#", 1)[0].split()
        if not words:
            continue
        key = words[0]
        if key == "v":
            vertices.append(_position(words, place, source))
        elif key in ("f", "fo"):
            indices = [_index(w, len(vertices), place, source) for w in words[1:]]
            corners.extend(indices)
            sizes.append(len(indices))
            lines.append(place)
            if len(sizes) > MOST_FACES:
                raise file_error(
                    source,
                    f"more than the {MOST_FACES} faces that can be read",
                    "reduce the mesh in a modelling program first",
                )
        elif key not in _PASSED_OVER:
            unknown.setdefault(key, place)
    if not vertices and unknown:
        word, place = next(iter(unknown.items()))
        raise file_error(source, f"not an OBJ file: line {place} starts with {word[:30]!r}", _EXPORT_AGAIN)
    if not sizes:
        raise file_error(
            source, f"{len(vertices)} vertices but no faces ('f' lines)", "export the mesh with its faces"
        )
    corner_array = np.array(corners, dtype=np.int64)
    size_array = np.array(sizes, dtype=np.int64)
    line_array = np.array(lines, dtype=np.int64)
    wrong = np.flatnonzero((corner_array < 0) | (corner_array >= len(vertices)))
    if len(wrong):
        face = int(np.searchsorted(np.cumsum(size_array), wrong[0], side="right"))
        raise file_error(
            source,
            f"face {face + 1} (line {lines[face]}) refers to vertex {corners[wrong[0]] + 1} "
            f"of {len(vertices)}",
            f"the file is damaged, {_EXPORT_AGAIN}",
        )
    notices = tuple(
        f"passed over unknown keyword {word[:30]!r} (line {place})"
        for word, place in list(unknown.items())[:3]
    )
    return RawMesh(source, np.array(vertices), corner_array, size_array, line_array, notices=notices)


def _position(words: list[str], number: int, source: str) -> tuple[float, ...]:
    """The coordinates of a ``v`` line; a weight or a colour behind them is passed over."""
    if len(words) < 4:
        raise file_error(
            source, f"line {number}: a vertex has three coordinates, found {len(words) - 1}", _EXPORT_AGAIN
        )
    try:
        return float(words[1]), float(words[2]), float(words[3])
    except ValueError:
        shown = " ".join(words)[:60]
        comma = re.search(r"\d,\d", shown)
        cure = "write decimal points, not commas" if comma else "correct the line or export the mesh again"
        raise file_error(source, f"line {number}: expected three numbers, found '{shown}'", cure) from None


def _index(word: str, count: int, number: int, source: str) -> int:
    """Vertex index from 0 of one corner such as ``7``, ``7/1/2``, ``7//2`` or, counted back, ``-1``.

    Positive indices may point to vertices that follow later in the file, so they are checked at the end.
    """
    try:
        index = int(word.split("/", 1)[0])
    except ValueError:
        raise file_error(
            source, f"line {number}: expected a vertex number, found {word[:30]!r}", _EXPORT_AGAIN
        ) from None
    if index == 0 or (index < 0 and -index > count):
        raise file_error(
            source,
            f"line {number}: vertex number {index} does not exist ({count} vertices so far, counted from 1)",
            f"the file is damaged, {_EXPORT_AGAIN}",
        )
    return index - 1 if index > 0 else count + index
