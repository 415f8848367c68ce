"""Nets as FOLD 1.2 files, the format of origami tools; what FOLD has no key for stands under ``blossom:``."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.atomic_file import write_atomic
from planner.base_trial import BaseTrial
from planner.dual_graph import DualGraph
from planner.errors import FormatError
from planner.goal_mesh import GoalMesh
from planner.net import Net, NetCertificate
from planner.net_proof import NetProof

__all__ = ["read_fold", "write_fold"]

ISOMETRY_MM = 1e-6
"""Largest difference between a side of a flat face and of its goal face."""

LETTERS = "VMFB"


def write_fold(net: Net, path: str | os.PathLike[str]) -> None:
    """Write ``net`` as a FOLD 1.2 file, with full precision and the same bytes for the same net.

    Source: FOLD specification 1.2 (Demaine, Ku, Lang); the ``blossom:`` keys as in ``docs/formats.md``.

    Raises:
        OSError: if the file cannot be written.
    """
    certificate = net.certificate
    data = {
        "file_spec": 1.2,
        "file_creator": "metal-blossom",
        "file_classes": ["singleModel"],
        "frame_title": net.goal.name,
        "frame_classes": ["creasePattern"],
        "frame_attributes": ["2D", "cuts", "noSelfTouching"],
        "frame_unit": "mm",
        "vertices_coords": net.vertices.tolist(),
        "edges_vertices": net.edges.tolist(),
        "edges_assignment": net.assignment.tolist(),
        "edges_foldAngle": [math.degrees(a) for a in net.fold_angle.tolist()],
        "faces_vertices": net.faces.tolist(),
        "blossom:faces_goal": net.goal.faces_goal.tolist(),
        "blossom:goal_sha256": net.goal.original.sha256,
        "blossom:base_face": net.base_face,
        "blossom:certificate": {
            "blooming_overlaps": certificate.blooming_overlaps,
            "edits": certificate.edits,
            "lower_bound": certificate.lower_bound,
            "optimal": certificate.optimal,
            "faces_left_out": certificate.faces_left_out,
            "method": certificate.method,
            "tree": certificate.tree,
            **({} if certificate.proof is None else {"proof": certificate.proof.to_json()}),
        },
    }
    if certificate.bases:
        data["blossom:bases"] = [trial.to_json() for trial in certificate.bases]
    rows = [f"{json.dumps(key)}: {_dump(value)}" for key, value in data.items()]
    write_atomic(path, ("{\n" + ",\n".join(rows) + "\n}\n").encode())


def read_fold(path: str | os.PathLike[str], goal: GoalMesh) -> Net:
    """Read the net of ``goal`` from a FOLD file that ``write_fold`` wrote, or another tool saved again.

    The tree is rebuilt from the creases, rooted at the base face. Fold angles of creases are the goal's own;
    those of the file must agree with them. Where the file says that faces were left out, the net is one of
    what is left of ``goal``.

    Raises:
        FormatError: if the file is not such a net, or not one of this goal; the message names the key.
        OSError: if the file cannot be read.
    """
    name = Path(path).name
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise FormatError(
            f"{name}: not a FOLD file, which is JSON ({error}); make it again with `blossom net`"
        ) from None
    if not isinstance(data, dict):
        raise FormatError(f"{name}: a FOLD file holds one JSON object, this one a {type(data).__name__}")
    reader = _Reader(name, data)
    return reader.net(goal)


class _Reader:
    """Checks the keys of one file and builds the net."""

    def __init__(self, name: str, data: dict[str, Any]) -> None:
        self.name = name
        self.data = data

    def fail(self, key: str, problem: str) -> FormatError:
        """An error that names file and key."""
        return FormatError(f"{self.name}: {key}: {problem}; make the net again with `blossom net`")

    def array(self, key: str, kind: type, width: int | None) -> NDArray[Any]:
        """The array under ``key``; ``width`` None for one number per item."""
        if key not in self.data:
            raise self.fail(key, "is missing")
        wanted = "numbers" if width is None else f"rows of {width} numbers"
        try:
            values = np.array(self.data[key], dtype=object)
            array: NDArray[Any] = values.astype(np.float64)
        except (TypeError, ValueError):
            raise self.fail(key, f"expected {wanted}") from None
        if width is not None and array.size == 0:
            array = array.reshape(0, width)
        if array.ndim != (1 if width is None else 2) or (width is not None and array.shape[1] != width):
            raise self.fail(key, f"expected {wanted}, got shape {array.shape}")
        if not np.isfinite(array).all():
            row = int(np.argwhere(~np.isfinite(array))[0, 0])
            raise self.fail(key, f"item {row} is not a finite number")
        if kind is int:
            whole = array.astype(np.int64)
            if not np.array_equal(whole, array):
                raise self.fail(key, "expected whole numbers")
            return whole
        return array

    def within(self, key: str, array: NDArray[Any], count: int, what: str) -> None:
        """Refuse indices outside 0 to count - 1."""
        if array.size and (array.min() < 0 or array.max() >= count):
            row = int(np.argwhere((array < 0) | (array >= count))[0, 0])
            raise self.fail(key, f"item {row} names a {what} outside 0 to {count - 1}")

    def net(self, goal: GoalMesh) -> Net:
        """The net of ``goal`` that the file holds."""
        owner = self.data.get("blossom:goal_sha256")
        if owner is not None and owner != goal.sha256:
            raise self.fail("blossom:goal_sha256", "the net was made from another goal mesh")
        vertices = self.array("vertices_coords", float, 2)
        faces = self.array("faces_vertices", int, 3)
        edges = self.array("edges_vertices", int, 2)
        letters = self.data.get("edges_assignment")
        if (
            not isinstance(letters, list)
            or len(letters) != len(edges)
            or any(
                not isinstance(letter, str) or letter not in LETTERS or len(letter) != 1 for letter in letters
            )
        ):
            raise self.fail(
                "edges_assignment", f"expected one of V, M, F, B for each of the {len(edges)} edges"
            )
        self.within("faces_vertices", faces, len(vertices), "vertex")
        self.within("edges_vertices", edges, len(vertices), "vertex")
        certificate = self._certificate()
        goal = self._without_left_out(goal, len(faces), certificate.faces_left_out)
        count = len(goal.faces)
        base = self.data.get("blossom:base_face")
        if not isinstance(base, int) or isinstance(base, bool) or not 0 <= base < count:
            raise self.fail("blossom:base_face", f"expected a face from 0 to {count - 1}, got {base!r}")
        angles = self.data.get("edges_foldAngle")
        if isinstance(angles, list):
            self.data["edges_foldAngle"] = [0.0 if angle is None else angle for angle in angles]
        degrees = self.array("edges_foldAngle", float, None)
        if len(degrees) != len(edges):
            raise self.fail("edges_foldAngle", f"expected {len(edges)} angles, got {len(degrees)}")
        self._check_shape(goal, vertices, faces)
        parent, crease = self._tree(faces, edges, letters, base)
        return Net(
            goal=goal,
            base_face=base,
            vertices=vertices,
            faces=faces,
            parent=parent,
            edges=edges,
            assignment=np.array(letters, dtype="<U1"),
            fold_angle=self._angles(goal, faces, edges, letters, degrees, parent, crease),
            crease_of=crease,
            certificate=certificate,
        )

    def _without_left_out(self, goal: GoalMesh, count: int, left_out: int) -> GoalMesh:
        """The goal without the faces that the file and its certificate say were left out."""
        total = len(goal.faces)
        numbers = self.data.get("blossom:faces_goal", list(range(count)))
        if not isinstance(numbers, list) or not all(type(number) is int for number in numbers):
            raise self.fail(
                "blossom:faces_goal", f"expected the number of a face of {goal.name} for each face"
            )
        missing = sorted(set(range(total)) - set(numbers))
        in_order = sorted(set(numbers)) == numbers and all(0 <= number < total for number in numbers)
        if not in_order or len(numbers) != count or len(missing) != left_out:
            but = f" but for {left_out} that the certificate says were left out" if left_out else ""
            raise self.fail(
                "blossom:faces_goal",
                f"expected the {total} faces of {goal.name} in their order{but}, got {count} faces",
            )
        return goal.without(missing)

    def _check_shape(self, goal: GoalMesh, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        """Refuse faces that are not the goal's, laid flat with the outer side up."""
        flat, solid = vertices[faces], goal.vertices[goal.faces]
        sides = [np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2) for corners in (flat, solid)]
        wrong = np.abs(sides[0] - sides[1]).max(axis=1)
        first, second = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
        mirrored = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] <= 0.0
        if wrong.max() > ISOMETRY_MM:
            face = int(wrong.argmax())
            raise self.fail(
                "faces_vertices",
                f"face {face} differs from face {face} of {goal.name} by {wrong[face]:.3g} mm in a side",
            )
        if mirrored.any():
            raise self.fail(
                "faces_vertices", f"face {int(mirrored.argmax())} is not counter-clockwise seen from +z"
            )

    def _tree(
        self,
        faces: NDArray[np.int64],
        edges: NDArray[np.int64],
        letters: list[str],
        base: int,
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Parent and crease of every face, from the creases of the file."""
        owners: dict[tuple[int, int], list[int]] = {}
        for face, corners in enumerate(faces.tolist()):
            for k in range(3):
                a, b = corners[k], corners[(k + 1) % 3]
                owners.setdefault((min(a, b), max(a, b)), []).append(face)
        beside: list[list[tuple[int, int]]] = [[] for _ in range(len(faces))]
        for edge, (a, b) in enumerate(edges.tolist()):
            sharing = owners.pop((min(a, b), max(a, b)), [])
            if len(sharing) != (1 if letters[edge] == "B" else 2):
                raise self.fail(
                    "edges_assignment",
                    f"edge {edge} is {letters[edge]} but has {len(sharing)} faces; a cut has one, others two",
                )
            if letters[edge] != "B":
                beside[sharing[0]].append((sharing[1], edge))
                beside[sharing[1]].append((sharing[0], edge))
        if owners:
            raise self.fail(
                "edges_vertices", f"face {next(iter(owners.values()))[0]} has a side that is no edge"
            )
        parent = np.full(len(faces), -2, dtype=np.int64)
        crease = np.full(len(faces), -1, dtype=np.int64)
        parent[base] = -1
        order = [base]
        for face in order:
            for other, edge in beside[face]:
                if edge == crease[face]:
                    continue
                if parent[other] != -2:
                    raise self.fail("edges_assignment", f"the creases form a cycle through edge {edge}")
                parent[other], crease[other] = face, edge
                order.append(other)
        if len(order) != len(faces):
            face = int(np.flatnonzero(parent == -2)[0])
            raise self.fail("edges_assignment", f"no creases join face {face} to the base face {base}")
        return parent, crease

    def _angles(
        self,
        goal: GoalMesh,
        faces: NDArray[np.int64],
        edges: NDArray[np.int64],
        letters: list[str],
        degrees: NDArray[np.float64],
        parent: NDArray[np.int64],
        crease: NDArray[np.int64],
    ) -> NDArray[np.float64]:
        """(E,) fold angles in rad: the goal's, which the file must agree with."""
        graph = DualGraph(goal)
        exact = np.zeros(len(edges))
        for face in np.flatnonzero(parent >= 0).tolist():
            edge = int(crease[face])
            ends = set(edges[edge].tolist())
            k = next(k for k in range(3) if {int(faces[face, k]), int(faces[face, (k + 1) % 3])} == ends)
            inner = int(graph.face_edges[face, k])
            if inner < 0 or int(parent[face]) not in graph.faces[inner].tolist():
                raise self.fail(
                    "edges_vertices", f"edge {edge} joins faces that are not neighbours in {goal.name}"
                )
            if letters[edge] != "F":
                exact[edge] = graph.fold_angle[inner]
            elif not graph.flat[inner]:
                raise self.fail("edges_assignment", f"edge {edge} is F, but the goal folds there")
        given = np.radians(degrees)
        wrong = np.abs(given - exact)
        if len(wrong) and wrong.max() > np.radians(0.1):
            edge = int(wrong.argmax())
            raise self.fail(
                "edges_foldAngle",
                f"edge {edge} has {degrees[edge]:.6g} degrees, but the goal {math.degrees(exact[edge]):.6g}",
            )
        for edge, letter in enumerate(letters):
            if letter in "VM" and (letter == "V") != (given[edge] > 0.0):
                raise self.fail(
                    "edges_assignment", f"edge {edge} is {letter} but folds by {degrees[edge]:.6g} degrees"
                )
        return exact

    def _certificate(self) -> NetCertificate:
        """The certificate; 0 and False where the file has none."""
        found = self.data.get("blossom:certificate", {})
        if not isinstance(found, dict):
            raise self.fail("blossom:certificate", "expected an object")
        numbers = {}
        for key in ("blooming_overlaps", "edits", "lower_bound", "faces_left_out"):
            value = found.get(key, 0)
            if not isinstance(value, int) or isinstance(value, bool) or value < 0:
                raise self.fail("blossom:certificate", f"{key} is a count, got {value!r}")
            numbers[key] = value
        optimal = found.get("optimal", False)
        words = {key: found.get(key, "") for key in ("method", "tree")}
        if not isinstance(optimal, bool) or any(not isinstance(word, str) for word in words.values()):
            raise self.fail("blossom:certificate", "optimal is true or false, method and tree are words")
        try:
            proof = NetProof.from_json(found["proof"]) if "proof" in found else None
        except ValueError as error:
            raise self.fail("blossom:certificate", f"proof: {error}") from None
        return NetCertificate(
            numbers["blooming_overlaps"], numbers["edits"], numbers["lower_bound"], optimal,
            numbers["faces_left_out"], words["method"], words["tree"], proof, self._bases(),
        )  # fmt: skip

    def _bases(self) -> tuple[BaseTrial, ...]:
        """The bases that were tried; none where the file does not say."""
        found = self.data.get("blossom:bases", [])
        if not isinstance(found, list):
            raise self.fail("blossom:bases", "expected a list")
        try:
            return tuple(BaseTrial.from_json(item) for item in found)
        except ValueError as error:
            raise self.fail("blossom:bases", str(error)) from None


def _dump(value: object) -> str:
    """JSON of one key; lists of lists get a line per row."""
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n" + ",\n".join(json.dumps(row, allow_nan=False) for row in value) + "\n]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
