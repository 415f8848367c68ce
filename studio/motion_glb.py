"""The folding motion as an animated glTF: one node per face, turning about its crease."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Bend, Clip, Cut, Fold, FoldPlan, Release, Rotate

if TYPE_CHECKING:
    from pygltflib import GLTF2

__all__ = ["STEP_SECONDS", "motion_glb"]

STEP_SECONDS = {"Fold": 0.6, "Rotate": 0.8, "Cut": 0.2, "Clip": 0.3, "Bend": 0.4, "Release": 0.8, "Wait": 0.0}
"""How long each kind of step takes in the animation."""

LARGEST_TURN_RAD = math.pi / 2
"""Between two keys a node turns at most so far, so that every viewer turns it the right way round."""

METRES_PER_MM = 0.001


@dataclass
class _Track:
    """Keys of one node: times in s and values."""

    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    def hold(self, time: float, value: float) -> None:
        """Add a key; a key that repeats the time of the last one is left out."""
        if self.times and time <= self.times[-1] + 1e-9:
            return
        self.times.append(time)
        self.values.append(value)

    def turn(self, start: float, end: float, before: float, after: float) -> None:
        """Turn from ``before`` to ``after`` (rad) between two times."""
        self.hold(start, before)
        pieces = max(1, math.ceil(abs(after - before) / LARGEST_TURN_RAD))
        for k in range(1, pieces + 1):
            share = k / pieces
            self.hold(start + (end - start) * share, before + (after - before) * share)


@dataclass
class _Tracks:
    """Keys of everything that moves: faces by number, the rotary, clipped and bent groups by step."""

    faces: dict[int, _Track] = field(default_factory=dict)
    rotary: _Track = field(default_factory=_Track)
    gone_at: dict[int, float] = field(default_factory=dict)
    bent: dict[int, _Track] = field(default_factory=dict)
    released_at: float = math.inf
    end: float = 0.0


def _tracks(plan: FoldPlan) -> _Tracks:
    out = _Tracks()
    out.rotary.hold(0.0, 0.0)
    angles = np.zeros(len(plan.net.edges))
    now, rotary = 0.0, 0.0
    for index, step in enumerate(plan.steps):
        end = now + STEP_SECONDS[type(step).__name__]
        match step:
            case Fold(crease=crease, to_rad=to):
                track = out.faces.setdefault(plan.net.child_of[crease], _Track([0.0], [0.0]))
                track.turn(now, end, float(angles[crease]), to)
                angles[crease] = to
            case Rotate(to_rad=to):
                out.rotary.turn(now, end, rotary, to)
                rotary = to
            case Clip():
                out.gone_at[index] = end
            case Bend(to_rad=to):
                track = out.bent.setdefault(index, _Track([0.0], [0.0]))
                track.turn(now, end, 0.0, to)
            case Release():
                out.released_at = end
            case Cut():
                pass
        now = end
    out.end = now
    return out


class _Binary:
    """Collects arrays into one buffer with accessors."""

    def __init__(self, gltf: GLTF2) -> None:
        self.gltf = gltf
        self.data = bytearray()

    def add(self, values: NDArray[Any], kind: str, target: int | None = None) -> int:
        """Append float32 values (N, k) or (N,); returns the number of the accessor."""
        from pygltflib import FLOAT, Accessor, BufferView

        array = np.ascontiguousarray(values, dtype=np.float32)
        rows = array.reshape(len(array), -1)
        self.gltf.bufferViews.append(
            BufferView(buffer=0, byteOffset=len(self.data), byteLength=array.nbytes, target=target)
        )
        self.data += array.tobytes()
        self.gltf.accessors.append(
            Accessor(
                bufferView=len(self.gltf.bufferViews) - 1, componentType=FLOAT, count=len(array), type=kind,
                min=[float(v) for v in rows.min(axis=0)], max=[float(v) for v in rows.max(axis=0)],
            )
        )  # fmt: skip
        return len(self.gltf.accessors) - 1


def _about(axis: NDArray[np.float64], angles: list[float]) -> NDArray[np.float64]:
    """(K, 4) quaternions x, y, z, w of turns by ``angles`` (rad) about a unit axis (3,)."""
    half = 0.5 * np.array(angles)
    return np.column_stack([np.sin(half)[:, None] * axis, np.cos(half)])


def motion_glb(plan: FoldPlan) -> bytes:
    """A binary glTF 2.0 file that plays the plan; the same plan gives the same bytes.

    Units are metres and y is up, as glTF demands; the root node brings the sheet frame there. Node
    ``face i`` turns about its crease below node ``face parent``; ``rotary`` turns everything, clipped
    pieces and at last the sheet vanish.
    """
    from pygltflib import (
        ARRAY_BUFFER,
        GLTF2,
        Animation,
        Asset,
        Attributes,
        Buffer,
        Material,
        Mesh,
        Node,
        Primitive,
        Scene,
    )
    from pygltflib import PbrMetallicRoughness as Surface

    net, sheet, tracks = plan.net, plan.sheet, _tracks(plan)
    gltf = GLTF2(asset=Asset(generator="Metal Blossom"))
    binary = _Binary(gltf)
    player = _Player(gltf, binary)
    for name, colour in (
        ("part", (0.70, 0.75, 0.80)),
        ("base", (0.45, 0.75, 0.65)),
        ("sheet", (0.80, 0.81, 0.83)),
    ):
        surface = Surface(baseColorFactor=[*colour, 1.0], metallicFactor=0.4, roughnessFactor=0.5)
        gltf.materials.append(Material(name=name, pbrMetallicRoughness=surface, doubleSided=True))

    def add_node(
        name: str,
        parent: int | None,
        mesh: int | None = None,
        shift: NDArray[np.float64] | None = None,
    ) -> int:
        translation = None if shift is None else [float(shift[0]), float(shift[1]), 0.0]
        gltf.nodes.append(Node(name=name, mesh=mesh, translation=translation))
        if parent is not None:
            gltf.nodes[parent].children.append(len(gltf.nodes) - 1)
        return len(gltf.nodes) - 1

    def add_mesh(name: str, corners: NDArray[np.float64], material: int) -> int:
        flat = np.zeros((corners.size // 2, 3))
        flat[:, :2] = corners.reshape(-1, 2)
        accessor = binary.add(flat, "VEC3", ARRAY_BUFFER)
        primitive = Primitive(attributes=Attributes(POSITION=accessor), material=material)
        gltf.meshes.append(Mesh(name=name, primitives=[primitive]))
        return len(gltf.meshes) - 1

    quarter = math.sqrt(0.5)
    root = add_node("machine", None)
    gltf.nodes[root].rotation = [-quarter, 0.0, 0.0, quarter]
    gltf.nodes[root].scale = [METRES_PER_MM] * 3
    rotary = add_node("rotary", root)
    player.turn(rotary, tracks.rotary, np.array([1.0, 0.0, 0.0]))

    panel = set(net.base_panel.tolist())
    origin = np.zeros((len(net.faces), 2))
    node_of: dict[int, int] = {}
    for face in net.order.tolist():
        parent = int(net.parent[face])
        axis = np.array([1.0, 0.0, 0.0])
        if parent >= 0:
            start, end = net.hinge(face)
            origin[face] = start
            axis = np.append((end - start) / np.linalg.norm(end - start), 0.0)
        above = rotary if parent < 0 else node_of[parent]
        shift = origin[face] - (origin[parent] if parent >= 0 else 0.0)
        mesh = add_mesh(f"face {face}", net.vertices[net.faces[face]] - origin[face], int(face in panel))
        node_of[face] = add_node(f"face {face}", above, mesh, shift)
        if face in tracks.faces:
            player.turn(node_of[face], tracks.faces[face], axis)

    groups: dict[int, list[int]] = {}
    for index, step in enumerate(plan.steps):
        if isinstance(step, Clip | Bend):
            groups[index] = list(step.faces)
    apart = {face for members in groups.values() for face in members}
    groups[-1] = [face for face in range(len(sheet.faces)) if face not in apart]
    for index, members in sorted(groups.items()):
        if not members:
            continue
        name = "sheet" if index < 0 else f"piece of step {index}"
        bend = plan.steps[index] if index >= 0 else None
        shift = np.array(bend.hinge[0]) if isinstance(bend, Bend) else np.zeros(2)
        mesh = add_mesh(name, sheet.triangles[members] - shift, 2)
        node = add_node(name, rotary, mesh, shift)
        if isinstance(bend, Bend):
            line = np.append(np.array(bend.hinge[1]) - shift, 0.0)
            player.turn(node, tracks.bent[index], line / np.linalg.norm(line))
        player.vanish(node, min(tracks.gone_at.get(index, math.inf), tracks.released_at))

    if player.channels:
        gltf.animations.append(Animation(name="fold", channels=player.channels, samplers=player.samplers))
    gltf.scenes.append(Scene(name=net.goal.name, nodes=[root]))
    gltf.scene = 0
    gltf.buffers.append(Buffer(byteLength=len(binary.data)))
    gltf.set_binary_blob(bytes(binary.data))
    return b"".join(gltf.save_to_bytes())


class _Player:
    """Adds animation channels."""

    def __init__(self, gltf: GLTF2, binary: _Binary) -> None:
        self.gltf = gltf
        self.binary = binary
        self.channels: list[Any] = []
        self.samplers: list[Any] = []

    def turn(self, node: int, track: _Track, axis: NDArray[np.float64]) -> None:
        """Turn a node about a unit axis (3,) through its origin, by the angles of a track."""
        if len(track.times) < 2:
            return
        self._add(node, "rotation", track.times, _about(axis, track.values), "VEC4", "LINEAR")

    def vanish(self, node: int, time: float) -> None:
        """Let a node vanish at a time."""
        if math.isfinite(time) and time > 0.0:
            self._add(node, "scale", [0.0, time], np.array([[1.0] * 3, [0.0] * 3]), "VEC3", "STEP")

    def _add(
        self, node: int, path: str, times: list[float], values: NDArray[np.float64], kind: str, how: str
    ) -> None:
        from pygltflib import AnimationChannel, AnimationChannelTarget, AnimationSampler

        sampler = AnimationSampler(
            input=self.binary.add(np.array(times), "SCALAR"),
            output=self.binary.add(values, kind),
            interpolation=how,
        )
        self.samplers.append(sampler)
        target = AnimationChannelTarget(node=node, path=path)
        self.channels.append(AnimationChannel(sampler=len(self.samplers) - 1, target=target))
