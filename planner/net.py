"""The flat net: every goal face laid into the plane, joined along creases to a base face."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.goal_mesh import GoalMesh
from planner.values import content_sha256, frozen_array

if TYPE_CHECKING:
    from planner.base_trial import BaseTrial
    from planner.net_proof import NetProof

__all__ = ["FLAT_FOLD_RAD", "Net", "NetCertificate"]

FLAT_FOLD_RAD = np.radians(0.05)
"""Creases that fold by less than this are flat joints (``F``): never cut, never folded."""


@dataclass(frozen=True)
class NetCertificate:
    """How near to blooming a net is.

    Attributes:
        blooming_overlaps: overlapping face pairs in the blooming tree that the net started from.
        edits: creases of the net that the blooming tree does not have.
        lower_bound: fewest edits that any overlap-free net needs, as far as proven.
        optimal: ``edits == lower_bound`` was proven.
        faces_left_out: goal faces that are missing (always 0 unless the user asked for it).
        method: the method that made the net, e.g. ``"nb"``.
        tree: the blooming tree that it started from, e.g. ``"steepest"``.
        proof: of ``lower_bound``, None if nothing was proven.
        bases: base faces that were tried, the chosen one first and then the runners-up, best first; empty if
            there was no choice.
    """

    blooming_overlaps: int
    edits: int
    lower_bound: int = 0
    optimal: bool = False
    faces_left_out: int = 0
    method: str = "nb"
    tree: str = "steepest"
    proof: NetProof | None = None
    bases: tuple[BaseTrial, ...] = ()


@dataclass(frozen=True, eq=False)
class Net:
    """A net of ``goal`` in the plane z = 0, outer side up (+z), faces corner by corner as in the goal.

    Face i of the net is face i of the goal. The creases are the edges that join a face to its parent;
    they form a spanning tree of the dual graph, rooted at ``base_face``.

    Attributes:
        goal: the mesh that the net folds to. Where faces were left out on request it is the rest, and
            ``goal.original`` the whole mesh, ``goal.faces_goal`` the face of it that each face of the net is.
        base_face: the stationary face.
        vertices: (N, 2) flat positions in mm; vertices are duplicated along cuts.
        faces: (F, 3) indices into ``vertices``, counter-clockwise seen from +z.
        parent: (F,) parent face of each face, -1 for the base face.
        edges: (E, 2) indices into ``vertices``, in a deterministic order.
        assignment: (E,) one letter per edge: V, M, F (flat joint) or B (cut or boundary).
        fold_angle: (E,) goal fold angle in rad; 0 flat, positive = valley (child turns towards +z).
        crease_of: (F,) index into ``edges`` of the edge that joins a face to its parent, -1 for the base.
        certificate: how near to blooming the net is.
    """

    goal: GoalMesh
    base_face: int
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    parent: NDArray[np.int64]
    edges: NDArray[np.int64]
    assignment: NDArray[np.str_]
    fold_angle: NDArray[np.float64]
    crease_of: NDArray[np.int64]
    certificate: NetCertificate = field(default_factory=lambda: NetCertificate(0, 0))

    def __post_init__(self) -> None:
        """Freeze the arrays, check their shapes, and let the certificate tell of missing faces."""
        count = len(self.faces)
        missing = len(self.goal.left_out)
        if self.certificate.faces_left_out != missing:
            certificate = replace(self.certificate, faces_left_out=missing)
            object.__setattr__(self, "certificate", certificate)
        for name, dtype, shape in (
            ("vertices", np.float64, (None, 2)),
            ("faces", np.int64, (None, 3)),
            ("parent", np.int64, (count,)),
            ("edges", np.int64, (None, 2)),
            ("assignment", "<U1", (len(self.edges),)),
            ("fold_angle", np.float64, (len(self.edges),)),
            ("crease_of", np.int64, (count,)),
        ):
            object.__setattr__(self, name, frozen_array(getattr(self, name), dtype, shape))

    @cached_property
    def sha256(self) -> str:
        """Content hash of the net (the certificate does not count)."""
        return content_sha256(
            "net/1", self.goal.sha256, self.base_face, self.vertices, self.faces, self.parent,
            self.edges, self.assignment, self.fold_angle,
        )  # fmt: skip

    @cached_property
    def order(self) -> NDArray[np.int64]:
        """(F,) faces from the base outwards, every parent before its children."""
        children: list[list[int]] = [[] for _ in range(len(self.faces))]
        for face, parent in enumerate(self.parent.tolist()):
            if parent >= 0:
                children[parent].append(face)
        order = [self.base_face]
        for face in order:
            order.extend(children[face])
        return frozen_array(order, np.int64, (len(self.faces),))

    @cached_property
    def child_of(self) -> dict[int, int]:
        """Crease (edge index) → the child face that it turns."""
        return {int(e): f for f, e in enumerate(self.crease_of.tolist()) if e >= 0}

    @cached_property
    def subtree(self) -> tuple[NDArray[np.int64], ...]:
        """For each face, the sorted faces that turn with it (itself included)."""
        members: list[list[int]] = [[f] for f in range(len(self.faces))]
        for face in self.order.tolist()[:0:-1]:
            members[int(self.parent[face])].extend(members[face])
        return tuple(frozen_array(sorted(m), np.int64, (None,)) for m in members)

    @cached_property
    def base_panel(self) -> NDArray[np.int64]:
        """The base face and the faces joined to it by flat joints: they never move."""
        panel = {self.base_face}
        for face in self.order.tolist()[1:]:
            if int(self.parent[face]) in panel and self.assignment[self.crease_of[face]] == "F":
                panel.add(face)
        return frozen_array(sorted(panel), np.int64, (None,))

    def hinge(self, face: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Ends (2,) of the crease of ``face`` in the flat net, in the order of the child's boundary.

        Turning the child by +angle about ``end - start`` (right-hand rule, z up) is a valley fold.
        """
        wanted = set(self.edges[self.crease_of[face]].tolist())
        corners = self.faces[face].tolist()
        for k in range(3):
            if {corners[k], corners[(k + 1) % 3]} == wanted:
                return self.vertices[corners[k]], self.vertices[corners[(k + 1) % 3]]
        raise ValueError(f"face {face} does not have its crease among its edges")
