"""Strict reader of PLY files, text and binary: positions and faces only."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.errors import MeshError
from planner.raw_mesh import MOST_FACES, RawMesh, file_error

__all__ = ["read_ply"]

_EXPORT_AGAIN = "export the mesh again"
_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class _Element:
    """One element of the header: its properties are (name, type, type of the list's count or "")."""

    name: str
    count: int
    properties: list[tuple[str, str, str]] = field(default_factory=list)


@dataclass
class _Rows:
    """The content of one element: columns of plain properties and lists by property name."""

    columns: dict[str, NDArray[np.float64]]
    lists: dict[str, tuple[NDArray[np.int64], NDArray[np.int64]]]


def read_ply(data: bytes, source: str) -> RawMesh:
    """Read the content of a PLY file of version 1.0.

    Raises:
        MeshError: no PLY header, cut off, no vertices or faces, an index that no vertex has.
    """
    if not data:
        raise file_error(source, "the file is empty (0 bytes)", _EXPORT_AGAIN)
    order, elements, start, header_lines = _header(data, source)
    if order:
        parts = _binary(data, start, order, elements, source)
    else:
        parts = _text(data[start:], elements, header_lines, source)
    points = parts.get("vertex")
    if points is None or not {"x", "y", "z"} <= points.columns.keys():
        raise file_error(source, "no element 'vertex' with x, y and z", _EXPORT_AGAIN)
    vertices = np.column_stack([points.columns[c] for c in "xyz"])
    lists = parts["face"].lists if "face" in parts else {}
    sizes, corners = next(
        (lists[name] for name in ("vertex_indices", "vertex_index") if name in lists),
        (np.zeros(0, np.int64), np.zeros(0, np.int64)),
    )
    if not len(sizes):
        raise file_error(source, f"{len(vertices)} vertices but no faces", "export the mesh with its faces")
    wrong = np.flatnonzero((corners < 0) | (corners >= len(vertices)))
    if len(wrong):
        face = int(np.searchsorted(np.cumsum(sizes), wrong[0], side="right"))
        raise file_error(
            source,
            f"face {face + 1} refers to vertex {corners[wrong[0]]} of {len(vertices)} (counted from 0)",
            f"the file is damaged, {_EXPORT_AGAIN}",
        )
    kinds = {kind for e in elements if e.name == "vertex" for name, kind, _ in e.properties if name in "xyz"}
    return RawMesh(source, vertices, corners, sizes, single_precision="f4" in kinds)


def _header(data: bytes, source: str) -> tuple[str, list[_Element], int, int]:
    """Byte order ("" for text), elements, offset of the content, lines of the header."""
    if data[:3] != b"ply":
        raise file_error(source, f"expected 'ply' at the start, found {data[:12]!r}", _EXPORT_AGAIN)
    end = data.find(b"end_header", 0, 1 << 20)
    stop = data.find(b"\n", end)
    if end < 0 or stop < 0:
        raise file_error(source, "the PLY header has no end ('end_header')", f"cut off, {_EXPORT_AGAIN}")
    order: str | None = None
    elements: list[_Element] = []
    lines = data[:end].decode("latin-1").splitlines()
    for number, line in enumerate(lines, 1):
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2])))
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append((words[4], _TYPES[words[3]], _TYPES[words[2]]))
            elif words[:1] == ["property"]:
                elements[-1].properties.append((words[2], _TYPES[words[1]], ""))
        except (IndexError, KeyError, ValueError):
            raise file_error(
                source, f"line {number} of the PLY header: cannot read {line[:60]!r}", _EXPORT_AGAIN
            ) from None
        if elements and not 0 <= elements[-1].count <= 3 * MOST_FACES:
            raise file_error(
                source,
                f"line {number} of the PLY header announces {elements[-1].count} elements",
                f"the file is damaged or larger than the {MOST_FACES} faces that can be read",
            )
    for element in elements:
        names = [name for name, _, _ in element.properties]
        if len(set(names)) < len(names) or any(":" in name for name in names):
            raise file_error(
                source, f"element {element.name!r} of the PLY header repeats a property", _EXPORT_AGAIN
            )
    if order is None:
        raise file_error(source, "the PLY header has no line 'format'", _EXPORT_AGAIN)
    return order, elements, stop + 1, len(lines) + 1


def _cut_off(source: str, element: _Element, row: int) -> MeshError:
    """The error for content that ends too early or cannot be read."""
    return file_error(
        source,
        f"cannot read {element.name} {row + 1} of {element.count}",
        f"the file is cut off or damaged, {_EXPORT_AGAIN}",
    )


def _text(content: bytes, elements: list[_Element], header_lines: int, source: str) -> dict[str, _Rows]:
    """Read the content of a text file: one row a line, empty lines passed over."""
    rows = [words for line in content.decode("latin-1").splitlines() if (words := line.split())]
    parts: dict[str, _Rows] = {}
    at = 0
    for element in elements:
        plain: list[list[float]] = []
        sizes: dict[str, list[int]] = {name: [] for name, _, count in element.properties if count}
        items: dict[str, list[int]] = {name: [] for name in sizes}
        for row in range(element.count):
            try:
                words = rows[at + row]
                values: list[float] = []
                k = 0
                for name, _, is_list in element.properties:
                    if is_list:
                        size = int(words[k])
                        entries = words[k + 1 : k + 1 + size]
                        if len(entries) != size:
                            raise _cut_off(source, element, row)
                        if name in ("vertex_indices", "vertex_index"):
                            items[name].extend(int(w) for w in entries)
                        sizes[name].append(size)
                        k += 1 + size
                    else:
                        values.append(float(words[k]))
                        k += 1
            except (IndexError, ValueError, OverflowError):
                raise file_error(
                    source,
                    f"cannot read {element.name} {row + 1} of {element.count} "
                    f"(about line {header_lines + at + row + 1})",
                    f"the file is cut off or damaged, {_EXPORT_AGAIN}",
                ) from None
            plain.append(values)
        at += element.count
        names = [name for name, _, count in element.properties if not count]
        table = np.array(plain, dtype=np.float64).reshape(element.count, len(names))
        parts[element.name] = _Rows(
            {name: table[:, k] for k, name in enumerate(names)},
            {n: (np.array(sizes[n], dtype=np.int64), np.array(items[n], dtype=np.int64)) for n in sizes},
        )
    return parts


def _binary(data: bytes, start: int, order: str, elements: list[_Element], source: str) -> dict[str, _Rows]:
    """Read the content of a binary file; rows whose lists all have one length are read at once."""
    parts: dict[str, _Rows] = {}
    at = start
    for element in elements:
        fields: list[tuple[str, str] | tuple[str, str, int]] = []
        probe = at
        for name, kind, count in element.properties:
            if count and element.count:
                size = _one(data, probe, order + count, source, element, 0)
                probe += np.dtype(count).itemsize + size * np.dtype(kind).itemsize
                fields += [(f"{name}:count", order + count), (name, order + kind, size)]
            else:
                probe += np.dtype(kind).itemsize
                fields.append((name, order + kind))
        record = np.dtype(fields)
        if at + record.itemsize * element.count <= len(data):
            table = np.frombuffer(data, dtype=record, count=element.count, offset=at)
            counts = [n for n in record.names or () if n.endswith(":count")]
            if all((table[n] == table[n][0]).all() for n in counts):
                columns = {n: table[n].astype(np.float64) for n, _, count in element.properties if not count}
                lists = {
                    n[:-6]: (table[n].astype(np.int64), table[n[:-6]].astype(np.int64).ravel())
                    for n in counts
                }
                parts[element.name] = _Rows(columns, lists)
                at += record.itemsize * element.count
                continue
        parts[element.name], at = _binary_rows(data, at, order, element, source)
    return parts


def _binary_rows(data: bytes, at: int, order: str, element: _Element, source: str) -> tuple[_Rows, int]:
    """Read the rows of one element one by one; returns them and the offset behind them."""
    plain: dict[str, list[float]] = {n: [] for n, _, count in element.properties if not count}
    sizes: dict[str, list[int]] = {n: [] for n, _, count in element.properties if count}
    items: dict[str, list[NDArray[np.int64]]] = {n: [] for n in sizes}
    for row in range(element.count):
        for name, kind, count in element.properties:
            width = np.dtype(kind).itemsize
            size = 1
            if count:
                size = _one(data, at, order + count, source, element, row)
                at += np.dtype(count).itemsize
            if size < 0 or at + size * width > len(data):
                raise _cut_off(source, element, row)
            values = np.frombuffer(data, dtype=order + kind, count=size, offset=at)
            at += size * width
            if count:
                sizes[name].append(size)
                items[name].append(values.astype(np.int64))
            else:
                plain[name].append(float(values[0]))
    columns = {n: np.array(v, dtype=np.float64) for n, v in plain.items()}
    lists = {
        n: (np.array(sizes[n], dtype=np.int64), np.concatenate([np.zeros(0, np.int64), *items[n]]))
        for n in sizes
    }
    return _Rows(columns, lists), at


def _one(data: bytes, at: int, dtype: str, source: str, element: _Element, row: int) -> int:
    """The count of a list at offset ``at``."""
    if at + np.dtype(dtype).itemsize > len(data):
        raise _cut_off(source, element, row)
    size = int(np.frombuffer(data, dtype=dtype, count=1, offset=at)[0])
    if not 0 <= size <= (len(data) - at):
        raise _cut_off(source, element, row)
    return size
