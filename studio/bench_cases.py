"""One case of ``blossom bench paper``: a net of one mesh, folded by every planner under every variant."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.fold_plan import MachineLimits
    from planner.goal_mesh import GoalMesh
    from planner.net import Net

__all__ = ["ALL_RULES", "VARIANTS", "BenchSettings", "Case", "Row", "run_case", "without_of"]

ALL_RULES = "all"
FLIPS_ONLY = "flips"
VARIANTS = (
    ALL_RULES, FLIPS_ONLY, "without-sight", "without-contact", "without-substrate", "without-held",
    "without-clearance",
)  # fmt: skip
"""All rules and tilt; all rules and flips only; all but one rule, with tilt."""

MESH_SUFFIXES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")


@dataclass(frozen=True)
class BenchSettings:
    """What is compared, and how much is tried.

    Attributes:
        limits: of the machine.
        planners: names in ``planner.FOLD_METHODS``.
        variants: names in ``VARIANTS``; planners that turn all creases at once only get the first of them.
        size_mm: longest side of every mesh; None keeps the size.
        max_faces: finer meshes are left out.
        net_budget_s: nominal seconds for each net.
        budgets_s: nominal seconds of a planner for each plan, by name.
    """

    limits: MachineLimits
    planners: tuple[str, ...]
    variants: tuple[str, ...]
    size_mm: float | None
    max_faces: int
    net_budget_s: float | None
    budgets_s: dict[str, float]


@dataclass(frozen=True)
class Case:
    """One net: of one mesh, by one method, with one seed."""

    mesh: Path
    net: str
    seed: int


@dataclass(frozen=True)
class Row:
    """One line of the table; figures are None where there is no plan.

    Attributes:
        mesh: name.
        faces: number of faces, 0 if the mesh could not be read.
        kind: ``closed`` or ``open``.
        seed: of net and planner.
        net: method of the net.
        planner: name of the planner.
        variant: name in ``VARIANTS``.
        status: ``ok``, ``bad mesh``, ``no net``, ``no plan`` or ``error``.
        completion: folded share of the angles.
        shape_rms_mm: shape error.
        clipped_area_mm2: of the sheet.
        clipped_faces: substrate triangles.
        rotations: of the rotary.
        seconds: CPU time of the plan.
        reason: what stands in the way, in words.
    """

    mesh: str
    faces: int
    kind: str
    seed: int
    net: str
    planner: str
    variant: str
    status: str
    completion: float | None = None
    shape_rms_mm: float | None = None
    clipped_area_mm2: float | None = None
    clipped_faces: int | None = None
    rotations: int | None = None
    seconds: float = 0.0
    reason: str = ""


def without_of(variant: str) -> tuple[str, ...]:
    """Rules that a variant switches off."""
    return (variant.removeprefix("without-"),) if variant.startswith("without-") else ()


def run_case(case: Case, settings: BenchSettings) -> list[Row]:
    """All rows of a case; whatever goes wrong ends up in ``status`` and ``reason``. Empty: too many faces."""
    from planner.errors import MeshError, NetError, PlannerError
    from planner.make_net import make_net
    from planner.read_goal import read_goal

    empty = Row(case.mesh.stem, 0, "", case.seed, case.net, "", "", "error")
    try:
        goal = read_goal(case.mesh, size_mm=settings.size_mm, limits=settings.limits)
    except (MeshError, OSError) as error:
        return _failed(empty, settings, "bad mesh", error)
    if len(goal.faces) > settings.max_faces:
        return []
    empty = replace(empty, faces=len(goal.faces), kind=_kind(goal))
    try:
        net = make_net(goal, method=case.net, seed=case.seed, budget_s=settings.net_budget_s)
    except NetError as error:
        return _failed(empty, settings, "no net", error)
    except (PlannerError, ArithmeticError, LookupError, ValueError) as error:
        return _failed(empty, settings, "error", error)
    return [_fold(net, row, settings) for row in _plain_rows(empty, settings)]


def _plain_rows(empty: Row, settings: BenchSettings) -> Iterator[Row]:
    """The rows of a case without figures."""
    from planner.motion_baselines import PLANNING_METHODS

    for planner in settings.planners:
        variants = settings.variants if planner in PLANNING_METHODS else settings.variants[:1]
        for variant in variants:
            yield replace(empty, planner=planner, variant=variant)


def _failed(empty: Row, settings: BenchSettings, status: str, error: Exception) -> list[Row]:
    reason = _words(error)
    return [replace(row, status=status, reason=reason) for row in _plain_rows(empty, settings)]


def _fold(net: Net, row: Row, settings: BenchSettings) -> Row:
    """One plan."""
    from planner.errors import PlanError, PlannerError
    from planner.motion_baselines import fold_method

    limits = settings.limits
    if row.variant == FLIPS_ONLY:
        limits = replace(limits, max_tilt_rad=0.0)
    start = time.process_time()
    try:
        result = fold_method(row.planner)(
            net, limits, seed=row.seed, budget_s=settings.budgets_s.get(row.planner),
            without=without_of(row.variant),
        )  # fmt: skip
    except PlanError as error:
        return replace(row, status="no plan", reason=_words(error), seconds=_since(start))
    except (PlannerError, ArithmeticError, LookupError, ValueError) as error:
        return replace(row, status="error", reason=_words(error), seconds=_since(start))
    return replace(
        row,
        status="ok",
        completion=result.completion,
        shape_rms_mm=result.shape_rms,
        clipped_area_mm2=result.clipped_area,
        clipped_faces=result.clipped_faces,
        rotations=result.rotations,
        seconds=_since(start),
        reason=result.stopped_by,
    )


def _kind(goal: GoalMesh) -> str:
    """``closed`` if every edge has two faces."""
    from planner.dual_graph import DualGraph

    return "closed" if 2 * len(DualGraph(goal).faces) == 3 * len(goal.faces) else "open"


def _since(start: float) -> float:
    return round(time.process_time() - start, 3)


def _words(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text or type(error).__name__
