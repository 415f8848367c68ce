"""Mesh files to raw polygons: which reader a file needs, and what holds for every format."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from planner.mesh_gltf import read_gltf
from planner.mesh_obj import read_obj
from planner.mesh_off import read_off
from planner.mesh_ply import read_ply
from planner.mesh_stl import read_stl
from planner.raw_mesh import RawMesh, file_error

__all__ = ["MESH_SUFFIXES", "MOST_BYTES", "read_mesh"]

_READERS = {".stl": read_stl, ".obj": read_obj, ".off": read_off, ".ply": read_ply}
MESH_SUFFIXES = (*_READERS, ".glb", ".gltf")
_FAR = 1e15
MOST_BYTES = 500_000_000
"""Larger files are refused: reading them would need gigabytes of memory."""


def read_mesh(path: str | os.PathLike[str]) -> tuple[RawMesh, bytes]:
    """Read a mesh file.

    Args:
        path: a file that ends in .stl, .obj, .off, .ply, .glb or .gltf (upper or lower case).

    Returns:
        The polygons, and the file's bytes (for their hash).

    Raises:
        MeshError: the file is missing, no file, too large, of another kind, damaged, without faces, or has
            a coordinate that is not finite.
    """
    file, source = Path(path), os.fspath(path)
    listed = ", ".join(MESH_SUFFIXES)
    if file.is_dir():
        raise file_error(source, "this is a folder, not a mesh file", f"name a file ({listed})")
    if not file.exists():
        raise file_error(source, "no such file", "check the path")
    suffix = file.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        what = f"unknown kind of file {suffix!r}" if suffix else "the file name has no extension"
        raise file_error(source, what, f"expected one of {listed}; rename or convert the file")
    if not file.is_file():
        raise file_error(source, "this is not a regular file", "copy the mesh to a file first")
    try:
        if file.stat().st_size > MOST_BYTES:
            raise file_error(
                source,
                f"{file.stat().st_size / 1e6:.0f} MB are more than the {MOST_BYTES / 1e6:.0f} MB "
                "that can be read",
                "reduce the mesh in a modelling program first",
            )
        data = file.read_bytes()
    except OSError as error:
        raise file_error(
            source, f"cannot be read ({error.strerror})", "check the file and its permissions"
        ) from error
    raw = read_gltf(data, file, source) if suffix in (".glb", ".gltf") else _READERS[suffix](data, source)
    used = np.zeros(len(raw.vertices), dtype=np.bool_)
    used[raw.corners] = True
    wrong = np.flatnonzero(used & ~(np.abs(raw.vertices) < _FAR).all(axis=1))
    if len(wrong):
        corner = int(np.flatnonzero(raw.corners == wrong[0])[0])
        polygon = int(np.searchsorted(np.cumsum(raw.sizes), corner, side="right"))
        shown = ", ".join(f"{c:g}" for c in raw.vertices[wrong[0]])
        raise file_error(
            source,
            f"vertex {wrong[0] + 1} of {raw.place(polygon)} is no usable point ({shown})",
            "correct the coordinate or export the mesh again",
        )
    return raw, data
