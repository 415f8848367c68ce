"""A net at a price the user allows: first as it is, then with the mesh changed, last with faces left out."""

from __future__ import annotations

from dataclasses import dataclass

from planner.errors import NetError
from planner.goal_mesh import GoalMesh
from planner.leave_out import net_with_faces_left_out
from planner.make_net import make_net
from planner.mesh_edits import MeshEdit, edit_until_net
from planner.net import Net

__all__ = ["CuredNet", "make_net_with_cures"]


@dataclass(frozen=True, eq=False)
class CuredNet:
    """A net, and what it took.

    Attributes:
        net: the net; ``net.goal.original`` is the goal that belongs to it.
        edit: how the goal was changed; None if it was not.
    """

    net: Net
    edit: MeshEdit | None = None


def make_net_with_cures(
    goal: GoalMesh,
    *,
    method: str = "nb",
    base_face: int | None = None,
    seed: int = 0,
    budget_s: float | None = None,
    mesh_edit_mm: float | None = None,
    leave_out: bool = False,
    kerf_mm: float = 0.1,
) -> CuredNet:
    """``make_net``; where there is none and the user allows it, the mesh is changed, then faces are left out.

    Args:
        goal: a mesh of one piece.
        method: see ``make_net``.
        base_face: the stationary face; None: chosen.
        seed: of every random choice.
        budget_s: nominal seconds of each of the searches, counted as work.
        mesh_edit_mm: how far the surface may deviate; None: the mesh is not changed.
        leave_out: whether faces may be left out.
        kerf_mm: width of a cut; a changed mesh has no face less than a tenth of it high.

    Raises:
        NetError: if nothing that is allowed gives a net; the message says what was tried.
    """
    try:
        return CuredNet(make_net(goal, method=method, base_face=base_face, seed=seed, budget_s=budget_s))
    except NetError as error:
        if not error.faces or (mesh_edit_mm is None and not leave_out):
            raise
    if mesh_edit_mm is not None:
        try:
            edit = edit_until_net(
                goal, mesh_edit_mm, base_face=base_face, seed=seed, budget_s=budget_s, kerf_mm=kerf_mm
            )
            net = make_net(edit.goal, method=method, base_face=base_face, seed=seed, budget_s=budget_s)
            return CuredNet(net, edit)
        except NetError:
            if not leave_out:
                raise
    return CuredNet(
        net_with_faces_left_out(goal, method=method, base_face=base_face, seed=seed, budget_s=budget_s)
    )
