"""``blossom make`` and ``blossom demo``: everything in one go."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from studio.exit_codes import DONE, NO
from studio.flags import (
    Base,
    BendFlags,
    Budget,
    Certify,
    CureFlags,
    Force,
    HeatFlags,
    Json,
    MachineFlags,
    Mesh,
    MeshFlags,
    NoDiagnosis,
    Output,
    Quiet,
    Seed,
    Tilt,
    Verbose,
    Without,
)  # fmt: skip
from studio.options import MachineOptions, MeshOptions, NetOptions, PlanOptions
from studio.progress import Progress
from studio.summary import print_summary

if TYPE_CHECKING:
    from studio.summary import Summary

__all__ = ["default_output", "demo", "make"]

DEMO_GOAL = "flower"


def default_output(mesh: Path) -> Path:
    """Folder for the bundle of a mesh: its name without the ending, in the current folder."""
    name = mesh.stem.strip(". ") or "blossom"
    return Path(name) if name != mesh.name else Path(f"{name}-bundle")


def make(
    mesh: Mesh,
    /,
    *,
    output: Output = None,
    machine: MachineFlags = MachineFlags(),  # noqa: B008  frozen
    read: MeshFlags = MeshFlags(),  # noqa: B008  frozen
    base: Base = None,
    cures: CureFlags = CureFlags(),  # noqa: B008  frozen
    tilt: Tilt = None,
    bend: BendFlags = BendFlags(),  # noqa: B008  frozen
    heat: HeatFlags = HeatFlags(),  # noqa: B008  frozen
    seed: Seed = 0,
    budget: Budget = None,
    without: Without = [],  # noqa: B006  never changed
    certify: Certify = False,
    no_diagnosis: NoDiagnosis = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    force: Force = False,
) -> int:
    """Make everything: net, plan, validation, job, replay on the emulated machine, report.

    The bundle appears whole at the end or not at all. A plan that cannot fold every crease still is a
    result; the summary says how far each crease comes and what stands in its way.

    Examples:
        blossom make bunny.obj

        blossom make bunny.obj -o out/bunny --size 60 --faces 150

        blossom make bracket.stl --scale 25.4 --material 1100 --thickness 0.2 --seed 7
    """
    from studio.pipeline import make as run

    summary = run(
        output or default_output(mesh),
        read.options(mesh),
        NetOptions(
            base=base, seed=seed, budget_s=budget, mesh_edit_mm=cures.mesh_edit, leave_out=cures.leave_out
        ),
        PlanOptions(
            tilt_deg=tilt,
            seed=seed,
            budget_s=budget,
            without=tuple(without),
            fixed_base=base is not None,
            bend_allowance=bend.bend_allowance == "on",
            relief=bend.relief,
            certify=certify,
            diagnosis=not no_diagnosis,
            prefer=heat.prefer,
            start_c=heat.start_temperature,
            take_turns=heat.take_turns,
            heating=heat.heating,
        ),
        machine.options(),
        force=force,
        progress=Progress(quiet=quiet or json, verbose=verbose),
    )
    print_summary(summary, as_json=json)
    return exit_code(summary)


def demo(
    *,
    output: Annotated[
        Path, Parameter(metavar="DIR", name=["-o", "--output"], help="Folder of the bundle.")
    ] = Path("blossom-demo"),
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Fold a shipped shape from mesh to replay on the emulated machine.

    Examples:
        blossom demo
    """
    from models.goals import goal_path
    from studio.pipeline import make as run

    summary = run(
        output, MeshOptions(Path(goal_path(DEMO_GOAL))), NetOptions(), PlanOptions(), MachineOptions(),
        force=True, progress=Progress(quiet=quiet or json),
    )  # fmt: skip
    print_summary(summary, as_json=json)
    if not json:
        print(f"\nOpen {output / 'report.html'} in a browser to see it fold.")  # noqa: T201  command output
    return exit_code(summary)


def exit_code(summary: Summary) -> int:
    """0 unless a verdict stands against the plan."""
    return DONE if summary.verdict in ("pass", "not validated") else NO
