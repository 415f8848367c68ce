"""Files of states: compressed numpy archives (``.npz``) with a JSON head, written whole, read with care."""

from __future__ import annotations

import io
import json
import os
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.atomic_file import write_atomic
from twin.errors import RecordFileError

__all__ = ["Record", "read_record", "record_bytes", "write_record"]

MOST_BYTES = 1 << 30
"""A file whose arrays unpack to more is not read."""

_HEAD = "head.json"
_EPOCH = (1980, 1, 1, 0, 0, 0)

Record = tuple[dict[str, Any], dict[str, NDArray[Any]]]
"""The head, and the arrays by name."""


def record_bytes(head: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """The file's content; the same values give the same bytes."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        text = json.dumps(dict(head), indent=1, ensure_ascii=False, allow_nan=False)
        archive.writestr(_entry(_HEAD), text.encode())
        for name, values in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.ascontiguousarray(values), allow_pickle=False)
            archive.writestr(_entry(f"{name}.npy"), member.getvalue())
    return out.getvalue()


def _entry(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name, _EPOCH)
    entry.compress_type = zipfile.ZIP_DEFLATED
    return entry


def write_record(
    path: str | os.PathLike[str], head: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> None:
    """Write a record, whole or not at all.

    Raises:
        OSError: if the file cannot be written.
    """
    write_atomic(path, record_bytes(head, arrays))


def read_record(
    path: str | os.PathLike[str], kind: str, version: int, arrays: Mapping[str, int], cure: str
) -> Record:
    """Read a record back.

    Args:
        path: the file.
        kind: expected ``format`` of the head.
        version: expected version.
        arrays: name → number of dimensions of the arrays of floats that must be there.
        cure: what to do about a damaged file, for the message.

    Raises:
        RecordFileError: if the file is damaged or is something else; the message says what and where.
        OSError: if it cannot be read.
    """
    data = Path(path).read_bytes()
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
            if size > MOST_BYTES:
                raise RecordFileError(
                    f"{path}: unpacks to {size >> 20} MiB, more than any such file of this program: {cure}"
                )
            members = {name: archive.read(name) for name in archive.namelist()}
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError) as error:
        if isinstance(error, RecordFileError):
            raise
        raise RecordFileError(f"{path}: damaged, or no file of states ({error}): {cure}") from error
    head = _head(path, members.get(_HEAD), kind, version, cure)
    out: dict[str, NDArray[Any]] = {}
    for name, dimensions in arrays.items():
        out[name] = _array(path, name, members.get(f"{name}.npy"), dimensions, cure)
    return head, out


def _head(
    path: str | os.PathLike[str], data: bytes | None, kind: str, version: int, cure: str
) -> dict[str, Any]:
    try:
        head = json.loads((data or b"").decode())
    except (ValueError, RecursionError) as error:
        raise RecordFileError(f"{path}: has no readable {_HEAD} ({error}): {cure}") from error
    if not isinstance(head, dict) or head.get("format") != kind:
        found = head.get("format") if isinstance(head, dict) else None
        raise RecordFileError(f"{path}: holds {found!r}, expected {kind!r}: {cure}")
    if head.get("version") != version:
        raise RecordFileError(f"{path}: version {head.get('version')!r}, expected {version}: {cure}")
    return head


def _array(
    path: str | os.PathLike[str], name: str, data: bytes | None, dimensions: int, cure: str
) -> NDArray[Any]:
    if data is None:
        raise RecordFileError(f"{path}: lacks the array {name}: {cure}")
    try:
        values = np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)
    except (ValueError, EOFError, MemoryError, SyntaxError) as error:
        raise RecordFileError(f"{path}: array {name} is damaged ({error}): {cure}") from error
    if values.dtype != np.float64 or values.ndim != dimensions:
        raise RecordFileError(
            f"{path}: array {name} is {values.ndim}-dimensional {values.dtype}, "
            f"expected {dimensions}-dimensional float64: {cure}"
        )
    return values
