"""Small changes of a goal that has no net: edges flipped, vertices moved, never further than allowed.

Tried in this order: flat panels triangulated anew, which leaves the shape as it is; edges flipped; vertices
moved. The first that gives a net is taken, at the smallest deviation that was found for it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.dual_graph import DualGraph
from planner.edge_flips import Flip, flipped, possible_flips
from planner.edit_trials import EditTrials
from planner.errors import NetError
from planner.goal_mesh import GoalMesh
from planner.vertex_moves import moved, vertex_moves

__all__ = ["EditKind", "MeshEdit", "edit_until_net"]

EditKind = Literal["triangulated", "flipped", "moved"]

MOST_FLIPS = 8
"""Edges that are flipped at most."""

AMPLITUDES = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
"""Shares of the allowed deviation by which vertices are moved, one after another."""

RANDOM_MOVES = 4
"""Random displacements tried at each amplitude."""

THINNINGS = 16
"""Trials to leave some of the moved vertices in place."""

HALVINGS = 4
"""Times that the step between moves that are too small and moves that give a net is halved."""


@dataclass(frozen=True, eq=False)
class MeshEdit:
    """A changed goal that has a net.

    Attributes:
        goal: the changed goal; its notices say what was done.
        kind: what was done.
        deviation_mm: old and new surface are nowhere further apart than this.
        changed: the new edges as vertex pairs, or the moved vertices.
        before_sha256: content hash of the goal as it was.
    """

    goal: GoalMesh
    kind: EditKind
    deviation_mm: float
    changed: tuple[tuple[int, int], ...] | tuple[int, ...]
    before_sha256: str

    @property
    def words(self) -> str:
        """What was done, in one line."""
        count = len(self.changed)
        edges = "1 edge" if count == 1 else f"{count} edges"
        vertices = "1 vertex" if count == 1 else f"{count} vertices"
        if self.kind == "triangulated":
            done = f"flat panels triangulated anew ({edges} flipped), the shape is the same"
        else:
            what = f"{edges} flipped" if self.kind == "flipped" else f"{vertices} moved"
            done = f"{what}, the surface deviates by at most {self.deviation_mm:.2g} mm"
        return f"changed the mesh on request, because it had no net as it was: {done}"


def edit_until_net(
    goal: GoalMesh,
    most_mm: float,
    *,
    base_face: int | None = None,
    seed: int = 0,
    budget_s: float | None = None,
    kerf_mm: float = 0.1,
) -> MeshEdit:
    """The smallest change of ``goal`` found that gives it a net.

    The deviation is an upper bound of the Hausdorff distance of old and new surface: that of
    ``edge_flips.possible_flips`` for flips of separate faces, the longest move for vertices.

    Args:
        goal: a goal for which no net was found.
        most_mm: largest deviation allowed, mm.
        base_face: the stationary face; None: any.
        seed: of every random choice.
        budget_s: nominal seconds, counted as work.
        kerf_mm: width of a cut; faces less than a tenth of it high are not made.

    Raises:
        NetError: if no such change was found.
        ValueError: if ``most_mm`` is not a positive number.
    """
    if not (np.isfinite(most_mm) and most_mm > 0.0):
        raise ValueError(f"the allowed deviation must be a finite length above 0 mm, got {most_mm}")
    trials = EditTrials(goal, base_face, seed, budget_s, kerf_mm)
    least, near = trials.overlaps(goal)
    graph = DualGraph(goal)
    flips = possible_flips(graph, most_mm)
    flat = [flip for flip in flips if flip.flat] if graph.has_rings else []
    edit = _flip_some(goal, trials, "triangulated", flat, least, near)
    edit = edit or _flip_some(goal, trials, "flipped", [f for f in flips if not f.flat], least, near)
    edit = edit or _move_some(graph, trials, near, most_mm, seed)
    if edit is None:
        why = ", until the budget was used up" if trials.spent else ""
        raise NetError(
            f"{goal.name} is not formable from one sheet, as far as was tried: not as it is, and none of "
            f"{trials.count - 1} changes of the mesh within {most_mm:g} mm gave a net{why}. Allow more with "
            "--mesh-edit, or leave faces out with --leave-out",
            tuple(near.tolist()),
        )
    return replace(edit, goal=replace(edit.goal, notices=(*goal.notices, edit.words)))


def _flip_some(
    goal: GoalMesh, trials: EditTrials, kind: EditKind, flips: list[Flip], least: int, near: NDArray[np.int64]
) -> MeshEdit | None:
    """One flip if any is enough, the least first; else more, as long as each leaves fewer overlaps."""
    faces = set(near.tolist())
    flips = sorted(flips, key=lambda flip: not faces.intersection(flip.faces))  # where it matters first
    chosen: list[Flip] = []
    while len(chosen) < MOST_FLIPS:
        best: Flip | None = None
        for flip in _separate(flips, chosen):
            if trials.spent:
                break
            if least == 0 and best is not None and flip.deviation_mm >= best.deviation_mm:
                continue  # one that is enough is known: only a smaller one is of interest
            changed = flipped(goal, [*chosen, flip])
            count, _ = trials.overlaps(changed)
            if (count < least or count == 0) and trials.is_sound(changed):
                best, least = flip, count
        if best is None:
            return None
        chosen.append(best)
        if least == 0:
            deviation = max(flip.deviation_mm for flip in chosen)
            ends = tuple(sorted(flip.ends for flip in chosen))
            return MeshEdit(flipped(goal, chosen), kind, deviation, ends, goal.sha256)
    return None


def _separate(flips: list[Flip], chosen: list[Flip]) -> list[Flip]:
    """The flips that share no face and no new edge with those that are chosen: deviations do not add up."""
    touched = {face for flip in chosen for face in flip.faces}
    ends = {flip.ends for flip in chosen}
    return [flip for flip in flips if not touched.intersection(flip.faces) and flip.ends not in ends]


def _move_some(
    graph: DualGraph, trials: EditTrials, near: NDArray[np.int64], most_mm: float, seed: int
) -> MeshEdit | None:
    """The smallest displacement of a growing series that gives a net, then made smaller still."""
    goal = graph.goal

    def works(displacement: NDArray[np.float64]) -> bool:
        changed = moved(goal, displacement)
        return trials.is_sound(changed) and trials.overlaps(changed)[0] == 0

    failed = 0.0
    for share in AMPLITUDES:
        for move in vertex_moves(graph, near, share * most_mm, seed, RANDOM_MOVES):
            if trials.spent:
                return None
            if not move.any() or not works(move):
                continue
            low, high = failed / share, 1.0
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                if works(middle * move):
                    high = middle
                else:
                    low = middle
            least = _fewer_vertices(high * move, works)
            deviation = float(np.linalg.norm(least, axis=1).max())
            changed = tuple(np.flatnonzero(least.any(axis=1)).tolist())
            return MeshEdit(moved(goal, least), "moved", deviation, changed, goal.sha256)
        failed = share
    return None


def _fewer_vertices(
    displacement: NDArray[np.float64], works: Callable[[NDArray[np.float64]], bool]
) -> NDArray[np.float64]:
    """``displacement`` with as many vertices left in place as a few trials show to be unnecessary."""
    least = displacement.copy()
    size = np.count_nonzero(least.any(axis=1)) // 2
    tries = 0
    while size >= 1 and tries < THINNINGS:
        moving = np.flatnonzero(least.any(axis=1))
        for start in range(0, len(moving), size):
            trial = least.copy()
            trial[moving[start : start + size]] = 0.0
            tries += 1
            if trial.any() and tries <= THINNINGS and works(trial):
                least = trial
        size //= 2
    return least
