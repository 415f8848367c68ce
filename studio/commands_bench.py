"""``blossom bench``: comparisons that a user can repeat."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from studio.bench_cases import VARIANTS
from studio.errors import UsageError
from studio.exit_codes import DONE
from studio.flags import Json, MachineFlags, Quiet, Tilt, positive
from studio.progress import Progress

__all__ = ["bench"]

Variant = Literal[
    "all", "flips", "without-sight", "without-contact", "without-substrate", "without-held",
    "without-clearance",
]  # fmt: skip
NETS, PLANNERS = ("nb", "ga"), ("fp", "mp", "first-block", "linear", "uniform")


def bench(
    what: Annotated[Literal["paper"], Parameter(help="paper: nets and planners as the paper compares them.")],
    /,
    *,
    meshes: Annotated[
        list[Path],
        Parameter(
            metavar="PATH", consume_multiple=True, show_default=False,
            help="Folders of meshes, or mesh files [the shapes that ship with the product].",
        ),
    ] = [],  # noqa: B006  never changed
    max_faces: Annotated[
        int, Parameter(metavar="N", validator=positive, help="Leave out meshes with more faces.")
    ] = 348,
    size: Annotated[
        float | None,
        Parameter(metavar="MM", validator=positive, help="Scale every mesh to this longest side."),
    ] = None,
    nets: Annotated[
        list[str],
        Parameter(
            metavar="NAME", consume_multiple=True, show_default=False, help="Methods of nets [nb ga]."
        ),
    ] = list(NETS),  # noqa: B006  never changed
    planners: Annotated[
        list[str],
        Parameter(
            metavar="NAME", consume_multiple=True, show_default=False,
            help="Planners [fp mp first-block linear uniform]; also fp-search (fp that tries other nets too) "
            "and rrt-connect (needs OMPL).",
        ),
    ] = list(PLANNERS),  # noqa: B006  never changed
    variants: Annotated[
        list[Variant],
        Parameter(
            metavar="NAME", consume_multiple=True, show_default=False,
            help="all, flips, and without- each rule [every one].",
        ),
    ] = list(VARIANTS),  # type: ignore[arg-type]  # noqa: B006  never changed
    seeds: Annotated[int, Parameter(metavar="N", validator=positive, help="Seeds, from 0.")] = 3,
    tilt: Tilt = None,
    net_budget: Annotated[
        float, Parameter(metavar="SECONDS", validator=positive, help="Nominal seconds for each net.")
    ] = 10.0,
    plan_budget: Annotated[
        float,
        Parameter(
            metavar="SECONDS", validator=positive,
            help="For each plan of a planner that searches: nominal seconds, of fp-search by the clock.",
        ),
    ] = 5.0,
    jobs: Annotated[
        int, Parameter(metavar="N", name=["-j", "--jobs"], validator=positive, help="Processes.")
    ] = 1,
    output: Annotated[
        Path, Parameter(metavar="DIR", name=["-o", "--output"], help="Folder of tables and pictures.")
    ] = Path("bench-paper"),
    resume: Annotated[
        bool, Parameter(show_default=False, help="Go on with the rows that are in the folder.")
    ] = False,
    machine: MachineFlags = MachineFlags(),  # noqa: B008  frozen
    json: Json = False,
    quiet: Quiet = False,
) -> int:  # fmt: skip
    """Compare nets and planners as the paper does, beside its figures.

    Every mesh gets a net by each method and seed, and every planner folds each of these nets as it is, with
    all rules and with one left out at a time. Rows go to paper.csv as they come; paper.md and pictures are
    written at the end, and at Ctrl-C. A mesh without a net is a row that says so.

    Examples:
        blossom bench paper -o out/paper

        blossom bench paper --meshes my/meshes --max-faces 60 -j 2
    """
    from planner.motion_baselines import FOLD_METHODS
    from planner.net_methods import NET_METHODS
    from rigs.limits import machine_limits
    from rigs.material import load_material
    from rigs.rig import load_rig
    from studio.bench_cases import BenchSettings
    from studio.bench_paper import find_meshes, headline_json, paper_cases, run_bench
    from studio.bench_tables import headline
    from studio.net_stage import known

    for name in nets:
        known("net method", name, tuple(NET_METHODS))
    for name in planners:
        known("planner", name, tuple(FOLD_METHODS))
    chosen = machine.options()
    limits = machine_limits(load_rig(chosen.rig), load_material(chosen.material), chosen.thickness_mm)
    if tilt is not None:
        most = math.degrees(limits.max_tilt_rad)
        if tilt > most + 1e-9:
            raise UsageError(f"--tilt {tilt:g}: rig {chosen.rig} tilts by 0 to {most:g} degrees")
        limits = replace(limits, max_tilt_rad=math.radians(tilt))
    found = find_meshes(meshes or [_shipped()])
    settings = BenchSettings(
        limits=limits,
        planners=tuple(planners),
        variants=tuple(v for v in VARIANTS if v in variants),
        size_mm=size,
        max_faces=max_faces,
        net_budget_s=net_budget,
        budgets_s=dict.fromkeys(("mp", "rrt-connect", "fp-search"), plan_budget),
    )
    rows = run_bench(
        paper_cases(found, nets, seeds), settings, output,
        command=" ".join(["blossom", "bench", what, *_told(sys.argv)]),
        jobs=jobs, resume=resume, progress=Progress(quiet=quiet or json),
    )  # fmt: skip
    if json:
        print(headline_json(rows))  # noqa: T201  command output
        return DONE
    for name, figures in headline(rows).items():
        here = figures.get("mean_percent", figures.get("percent"))
        paper = figures["paper_percent"]
        words = "–" if here is None else f"{here:.2f} %"
        print(f"{name:<22}{words:>10}" + (f"   paper {paper:.2f} %" if paper else ""))  # noqa: T201
    print(f"\ntables and pictures: {output}")  # noqa: T201
    return DONE


def _shipped() -> Path:
    """The folder of the shapes that ship with the product."""
    from models.goals import goal_path

    return Path(goal_path("flower")).parent


def _told(arguments: list[str]) -> list[str]:
    """What the user gave after ``bench paper``."""
    words = arguments[1:]
    return words[words.index("paper") + 1 :] if "paper" in words else []
