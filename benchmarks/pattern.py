"""What bend allowance and relief holes change: shift, shape error without, holes, machine time.

``python benchmarks/pattern.py --meshes ../shared/meshes/real/bunny-128.obj ../shared/meshes/proc/cube.obj``

The net that ``make_net`` gives is folded as it is, on ``grbl-4axis`` in 0.1 mm of 304. Machine time is the
sum of the planned seconds of all blocks of the job, so it does not depend on the computer.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

from planner.errors import PlannerError
from planner.fold_plan import Cut, FoldPlan
from planner.make_net import make_net
from planner.pattern_check import pattern_figures, with_pattern
from planner.plan_folds import plan_folds
from planner.read_goal import read_goal
from planner.relief import is_relief
from rigs.job_build import make_job
from rigs.limits import machine_limits
from rigs.material import load_material
from rigs.rig import load_rig
from twin.plan_process import plan_process

RIG, MATERIAL = load_rig("grbl-4axis"), load_material("304")


def job_of(plan: FoldPlan) -> tuple[float, int]:
    """Planned seconds of the machine, and blocks."""
    job = make_job(plan, plan_process(plan, RIG, MATERIAL), RIG, MATERIAL)
    return job.seconds, len(job.blocks)


def row(path: Path, size_mm: float) -> str:
    """One line of the table."""
    limits = machine_limits(RIG, MATERIAL)
    sharp = replace(limits, bend_width=0.0, neutral_shift=0.0, relief_mm=0.0)
    goal = read_goal(path, size_mm=size_mm)
    plain = plan_folds(make_net(goal), sharp, keep_net=True)
    began = time.process_time()
    plan = with_pattern(replace(plain, limits=limits))
    spent = time.process_time() - began
    figures = pattern_figures(plan)
    words = next((s.why for s in plan.steps if isinstance(s, Cut) and is_relief(s)), ": none")
    holes = words.partition(": ")[2].removeprefix("holes at ").partition(" corners")[0]
    (before, few), (after, many) = job_of(plain), job_of(plan)
    told = [notice for notice in plan.notices if notice not in plain.notices]
    return (
        f"| {path.stem} | {len(goal.faces)} | {figures.largest_shift:.3f} | {figures.shape_rms_without:.3f} "
        f"| {figures.overlap:.3f} | {figures.kerf_loss_mm2:.2f} | {holes} | {before:.0f} → {after:.0f} "
        f"| {few} → {many} | {spent:.1f} | {'; '.join(told)} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--meshes", nargs="+", type=Path, required=True, help="mesh files")
    parser.add_argument("--size", type=float, default=80.0, help="longest side in mm")
    chosen = parser.parse_args()
    print(
        "| mesh | faces | largest shift mm | shape rms without mm | overlap mm | kerf loss mm² | holes "
        "| machine s | blocks | CPU s | notices |\n|" + "---|" * 11
    )
    for path in chosen.meshes:
        try:
            print(row(path, chosen.size), flush=True)
        except PlannerError as error:
            print(f"| {path.stem} | | | | | | | | | | {error} |", flush=True)


if __name__ == "__main__":
    main()
