"""Margin and sight of every fold for the report: from the proofs of the bundle, or looked at for the page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from studio.contact_stage import CONTACT_FILE, SIGHT_FILE
from studio.report_steps import StepRoom

if TYPE_CHECKING:
    from studio.workspace import Workspace

__all__ = ["step_rooms"]


def step_rooms(ws: Workspace) -> dict[int, StepRoom]:
    """Step index → margin and sight of every fold.

    ``contact.json`` and ``sight.json`` are read where the bundle has them. Without them margins are proven
    now, which is quick, and sight is looked at where each turn begins and ends. Plans that bend the sheet
    have neither: the proofs do not cover them.
    """
    from planner.errors import PlanError

    try:
        margins, limit = _margins(ws)
        seen, proven = _sight(ws)
    except PlanError:
        return {}
    return {
        step: StepRoom(margins.get(step), limit, seen.get(step), proven)
        for step in sorted(margins.keys() | seen.keys())
    }


def _margins(ws: Workspace) -> tuple[dict[int, float], float]:
    from planner.contact_certificate import ENOUGH_MM, certify_contact

    kept = _kept(ws, CONTACT_FILE)
    if kept is not None:
        return {int(row["step"]): float(row["margin"]) for row in kept["steps"]}, float(kept["told_up_to"])
    return {turn.step: turn.margin_mm for turn in certify_contact(ws.plan).turns}, ENOUGH_MM


def _sight(ws: Workspace) -> tuple[dict[int, float], bool]:
    from planner.sight_certificate import certify_sight

    kept = _kept(ws, SIGHT_FILE)
    if kept is not None:
        return {int(row["step"]): 1.0 - float(row["hidden"]) for row in kept["steps"]}, True
    return {turn.step: 1.0 - turn.hidden for turn in certify_sight(ws.plan, ends_only=True).turns}, False


def _kept(ws: Workspace, name: str) -> Mapping[str, Any] | None:
    if name not in ws.manifest.files:
        return None
    values: dict[str, Any] = json.loads(ws.path(name).read_bytes())
    return values
