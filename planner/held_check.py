"""Rule 5 replayed: the part stays held, folded creases are free, and only what is clipped falls.

This replay knows the plan's steps and shapes only; it shares no decision with the code that made the plan.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Clip, Cut, Fold, FoldPlan, Polyline, Release
from planner.metal_pieces import NOWHERE, incentres, metal_left, piece_of, thread_mm

__all__ = ["check_held"]


def check_held(plan: FoldPlan) -> list[str]:
    """Play ``plan`` in the plane of the sheet and say where it breaks rule 5, a line each; empty if nowhere.

    At every step the metal is the sheet less what has been burnt and clipped. The base panel and everything
    that hangs on it must be joined to the clamped frame until the release; substrate that comes loose must be
    clipped at once; a crease may turn only when nothing but the crease joins its subtree to other metal.
    """
    return _Replay(plan).run()


@dataclass
class _State:
    """The metal at one moment: piece of every face and substrate triangle, and the same with creases cut."""

    face_piece: NDArray[np.int64]
    triangle_piece: NDArray[np.int64]
    held: frozenset[int]
    face_panel: NDArray[np.int64]
    triangle_panel: NDArray[np.int64]
    content: dict[int, tuple[set[int], bool]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Note the faces, and whether substrate, in each piece that is left when all creases are cut."""
        for face, piece in enumerate(self.face_panel.tolist()):
            self.content.setdefault(piece, (set(), False))[0].add(face)
        for piece in set(self.triangle_panel.tolist()):
            faces, _ = self.content.get(piece, (set(), False))
            self.content[piece] = (faces, True)
        self.content.pop(NOWHERE, None)


class _Replay:
    def __init__(self, plan: FoldPlan) -> None:
        import shapely

        self.plan = plan
        self.net = plan.net
        self.burnt: list[Polyline] = []
        self.clipped: set[int] = set()
        self.problems: list[str] = []
        self.outline = shapely.Polygon(plan.sheet.outline)
        self.triangles = shapely.polygons(plan.sheet.triangles)
        self.frame = set(np.flatnonzero(plan.sheet.frame_faces).tolist())
        self.face_spots = incentres(plan.net.vertices[plan.net.faces])
        self.triangle_spots = incentres(plan.sheet.triangles)
        self.state: _State | None = None

    def run(self) -> list[str]:
        """Play all steps. Cuts take effect together before the next other step: metal only gets less."""
        released = False
        for n, step in enumerate(self.plan.steps):
            changed = self.state is None
            if isinstance(step, Cut):
                self._burn(step.paths)
                continue
            if changed:
                self._base_held(n)
            if isinstance(step, Clip):
                self._clip(n, step)
                continue
            if changed and not released:
                self._loose(n)
            if isinstance(step, Fold):
                self._free(n, step)
            elif isinstance(step, Release):
                self._burn(step.paths)
                state = self.now()
                if set(state.face_piece.tolist()) & state.held:
                    self._say(n, "the release leaves the part joined to the frame")
                released = True
                break
        if not released:
            self.problems.append("the plan never releases the part from the sheet")
        return self.problems

    def now(self) -> _State:
        """The metal as it is, computed again only after something changed."""
        if self.state is None:
            self.state = self._build()
        return self.state

    def _build(self) -> _State:
        import shapely

        gone = self.triangles[sorted(self.clipped)]
        metal = metal_left(self.outline, shapely.MultiLineString(self.burnt), gone, self.plan.limits.kerf)
        pieces = shapely.get_parts(metal)
        face_piece = piece_of(pieces, self.face_spots)
        triangle_piece = piece_of(pieces, self.triangle_spots)
        held = frozenset(triangle_piece[sorted(self.frame)].tolist()) - {NOWHERE}
        creases = self.net.assignment != "B"
        folded = creases & (self.net.assignment != "F")
        lines = shapely.linestrings(self.net.vertices[self.net.edges[folded]])
        along = shapely.buffer(shapely.multilinestrings(lines), 2.0 * thread_mm(self.plan.limits.kerf))
        panels = shapely.get_parts(metal.difference(along))
        return _State(
            face_piece, triangle_piece, held,
            piece_of(panels, self.face_spots), piece_of(panels, self.triangle_spots),
        )  # fmt: skip

    def _burn(self, paths: Iterable[Polyline]) -> None:
        self.burnt += [path for path in paths if len(path) > 1]
        self.state = None

    def _clip(self, n: int, step: Clip) -> None:
        state = self.now()
        wanted = set(step.faces)
        if wanted & self.frame:
            self._say(n, f"clips triangle {min(wanted & self.frame)} of the clamped frame")
        for t in sorted(wanted & self.clipped):
            self._say(n, f"clips triangle {t} a second time")
        pieces = {int(state.triangle_piece[t]) for t in wanted} - {NOWHERE}
        carried = np.flatnonzero(np.isin(state.face_piece, sorted(pieces)))
        if len(carried):
            self._say(n, f"clips metal that is still joined to face {carried[0]}")
        for t in np.flatnonzero(np.isin(state.triangle_piece, sorted(pieces))).tolist():
            if t not in wanted and t not in self.clipped:
                self._say(n, f"clips metal that is still joined to substrate triangle {t}")
                break
        self.clipped |= wanted
        self.state = None

    def _loose(self, n: int) -> None:
        state = self.now()
        for t, piece in enumerate(state.triangle_piece.tolist()):
            if piece != NOWHERE and piece not in state.held and t not in self.clipped:
                self._say(n, f"substrate triangle {t} comes loose and is not clipped")
                return

    def _base_held(self, n: int) -> None:
        state = self.now()
        loose = [
            f
            for f, piece in enumerate(state.face_piece.tolist())
            if piece != NOWHERE and piece not in state.held
        ]
        if self.net.base_face in loose:
            self._say(n, f"the base face {self.net.base_face} is no longer joined to the frame")
        elif loose:
            self._say(n, f"face {loose[0]} is no longer joined to the base")

    def _free(self, n: int, step: Fold) -> None:
        state = self.now()
        child = self.net.child_of.get(step.crease)
        if child is None:
            self._say(n, f"folds edge {step.crease}, which is not a crease")
            return
        inside = set(self.net.subtree[child].tolist())
        for piece in sorted({int(state.face_panel[f]) for f in inside} - {NOWHERE}):
            faces, substrate = state.content[piece]
            if substrate:
                self._say(n, f"crease {step.crease} turns while its faces are still joined to the sheet")
                return
            if not faces <= inside:
                other = min(faces - inside)
                self._say(n, f"crease {step.crease} turns while its faces are still joined to face {other}")
                return

    def _say(self, n: int, words: str) -> None:
        line = f"step {n}: {words}"
        if line not in self.problems:
            self.problems.append(line)
