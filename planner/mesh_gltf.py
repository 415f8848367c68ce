"""Reader of glTF 2.0 files (``.glb`` and ``.gltf``) through trimesh."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from planner.raw_mesh import MOST_FACES, RawMesh, file_error

__all__ = ["read_gltf"]

METRE_MM = 1000.0


def read_gltf(data: bytes, path: Path, source: str) -> RawMesh:
    """Read all triangles of a glTF scene, every node at its place in the world.

    Source: glTF 2.0, section 3.4: lengths are metres, so ``unit_mm`` of the result is 1000.

    Raises:
        MeshError: the file is cut off, is no glTF, needs a file that is missing, or has no triangles.
    """
    if not data:
        raise file_error(source, "the file is empty (0 bytes)", "export the mesh again")
    if path.suffix.lower() == ".glb":
        announced = int.from_bytes(data[8:12], "little")
        if data[:4] != b"glTF" or announced != len(data):
            what = (
                "not a GLB file (no 'glTF' at the start)"
                if data[:4] != b"glTF"
                else f"cut off: the header announces {announced} bytes, there are {len(data)}"
            )
            raise file_error(source, what, "export the mesh again")
    _require_sane_counts(data, source)
    import trimesh

    try:
        scene: Any = trimesh.load_scene(path, process=False, skip_materials=True)
        pieces = []
        for node in scene.graph.nodes_geometry:
            matrix, name = scene.graph[node]
            geometry = scene.geometry[name]
            if isinstance(geometry, trimesh.Trimesh) and len(geometry.faces):
                points = geometry.vertices @ matrix[:3, :3].T + matrix[:3, 3]
                faces = np.asarray(geometry.faces, dtype=np.int64)
                if np.linalg.det(matrix[:3, :3]) < 0.0:
                    faces = faces[:, ::-1]
                pieces.append((np.asarray(points, dtype=np.float64), faces))
    except Exception as error:  # a parser of foreign files may raise anything
        raise file_error(
            source, f"cannot be read as glTF ({type(error).__name__}: {error})", "export the mesh again"
        ) from error
    count = sum(len(faces) for _, faces in pieces)
    if not count:
        raise file_error(source, "the scene has no triangles", "export the mesh with its faces")
    if count > MOST_FACES:
        raise file_error(
            source, f"{count} faces are more than the {MOST_FACES} that can be read", "reduce the mesh first"
        )
    offsets = np.cumsum([0] + [len(points) for points, _ in pieces])
    corners = np.concatenate(
        [(f + o).ravel() for (_, f), o in zip(pieces, offsets[:-1].tolist(), strict=True)]
    )
    if any(faces.min() < 0 or faces.max() >= len(points) for points, faces in pieces):
        raise file_error(
            source,
            "a triangle refers to a vertex that does not exist",
            "the file is damaged, export it again",
        )
    return RawMesh(
        source,
        np.concatenate([points for points, _ in pieces]),
        corners,
        np.full(count, 3, dtype=np.int64),
        soup=True,
        single_precision=True,
        unit_mm=METRE_MM,
    )


def _require_sane_counts(data: bytes, source: str) -> None:
    """Refuse accessors that announce more elements than can be read: they need no bytes in the file."""
    text = data
    if data[:4] == b"glTF":
        text = data[20 : 20 + int.from_bytes(data[12:16], "little")]
    try:
        accessors = json.loads(text)["accessors"]
        largest = max((int(a["count"]) for a in accessors), default=0)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise file_error(source, "no glTF description with accessors", "export the mesh again") from error
    if not 0 < largest <= 3 * MOST_FACES:
        raise file_error(
            source,
            f"an accessor announces {largest} elements",
            f"the file is damaged or larger than the {MOST_FACES} faces that can be read",
        )
