"""``blossom net --verify``: a net and the proof in it checked afresh, and what came of it in words."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from studio.errors import UsageError
from studio.exit_codes import DONE, NO
from studio.options import MeshOptions

if TYPE_CHECKING:
    from planner.goal_mesh import GoalMesh
    from planner.net_proof import ProofCheck

__all__ = ["verify_net"]

GOAL_NAME = "goal.ply"


def verify_net(file: Path, mesh: MeshOptions | None, *, as_json: bool) -> int:
    """Check ``file`` against its goal and print what was found.

    Args:
        file: the net, as FOLD.
        mesh: the goal that it was made from; None: ``goal.ply`` beside the net.
        as_json: print one JSON object.

    Returns:
        0 if the net and all that its certificate claims were confirmed, else 1.

    Raises:
        FormatError: if the file is no net of the goal.
        UsageError: if there is no goal.
    """
    from planner.net_proof import verify_fold

    if file.is_dir():
        raise UsageError(f"--verify {file}: is a folder, expected a file; try {file / 'net.fold'}")
    if not file.exists():
        raise UsageError(f"--verify {file}: no such file; name the net.fold of a bundle")
    check = verify_fold(file, _goal(file, mesh))
    if as_json:
        values = {
            "format": "metal-blossom/net-check", "version": 1, "file": str(file), "holds": check.holds,
            **asdict(check),
        }  # fmt: skip
        print(json.dumps(values, ensure_ascii=False, allow_nan=False))  # noqa: T201  command output
    else:
        print("\n".join(_lines(file, check)))  # noqa: T201  command output
    return DONE if check.holds else NO


def _goal(file: Path, mesh: MeshOptions | None) -> GoalMesh:
    """The goal of a net: the one that is given, or the one beside the file."""
    from planner.goal_file import read_goal_ply
    from planner.read_goal import read_goal

    if mesh is None:
        beside = file.parent / GOAL_NAME
        if not beside.exists():
            raise UsageError(
                f"--verify {file}: there is no {GOAL_NAME} beside it; "
                f"name the mesh: blossom net MESH --verify {file}"
            )
        return read_goal_ply(beside)
    if mesh.path.name == GOAL_NAME:
        return read_goal_ply(mesh.path)
    return read_goal(mesh.path, size_mm=mesh.size_mm, scale=mesh.scale, max_faces=mesh.faces)


def _lines(file: Path, check: ProofCheck) -> list[str]:
    """What was found, one line for each figure and problem."""
    edits = "1 edit" if check.edits == 1 else f"{check.edits} edits"
    shown = f"at least {check.lower_bound}" + (", so there is no better net" if check.optimal else "")
    good = "1 reason" if check.no_goods == 1 else f"{check.no_goods} reasons"
    lines = [
        f"{'net':<13}{file}",
        f"{'net edits':<13}{edits}, counted afresh",
        f"{'needed':<13}{shown} ({good} why edges must be cut, each laid out again)",
        f"{'verdict':<13}{'holds' if check.holds else 'does not hold'}",
    ]
    return lines + [f"problem: {problem}" for problem in check.problems]
