"""What knowing the heat in the net saves: machine time against naive waiting, start temperatures, energy.

``python benchmarks/thermal.py --meshes ../shared/meshes/real/bunny-48.obj ../shared/meshes/proc/bugbot6.obj``

The net that ``make_net`` gives is folded as it is, on ``grbl-4axis`` in 0.1 mm of 304. Columns:

- cold: every pass waits until its crease is at 30 °C again, each crease taken alone: a lower bound;
- fixed: one and the same wait after every pass, the shortest that keeps every start at 200 °C or colder;
- in order: each wait as short as the heat in the net allows, folds in the order of the plan;
- turns: the same with folds that take turns;
- alone: the warmest start that waits give which are made for each crease alone, without the rest of the net.

Times are the planned seconds of all blocks of the job, so they do not depend on the computer; "cpu" is the
time that the schedule in order takes.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from planner.fold_plan import FoldPlan
from planner.make_net import make_net
from planner.plan_folds import plan_folds
from planner.read_goal import read_goal
from rigs.job_build import make_job
from rigs.limits import machine_limits
from rigs.material import load_material
from rigs.process import Process
from rigs.rig import load_rig
from twin.interleave import interleave
from twin.net_heat import NetHeat
from twin.plan_process import ALLOWED_START_C, plan_process

RIG, MATERIAL = load_rig("grbl-4axis"), load_material("304")


def job_s(plan: FoldPlan, process: Process) -> float:
    """Planned seconds of the machine."""
    return make_job(plan, process, RIG, MATERIAL).seconds


def peak_c(plan: FoldPlan, process: Process, fixed_s: float | None = None) -> float:
    """Warmest start in the net with the waits of a process, or with one fixed wait; stops above 1000 °C."""
    heat = NetHeat(plan.net, MATERIAL, plan.limits.thickness)
    peak = 0.0
    for fold in process.folds:
        stroke = (fold.seconds - sum(fold.waits_s)) / max(fold.passes, 1)
        line = 1e3 * process.absorptivity * fold.power_w / fold.speed_mm_s
        for wait in fold.waits_s:
            peak = max(peak, heat.start_c(fold.crease))
            heat.burn(fold.crease, line)
            heat.wait_until(heat.now_s + stroke + (wait if fixed_s is None else fixed_s))
        if fixed_s is not None and peak > ALLOWED_START_C:
            break
    return peak


def shortest_fixed_wait(plan: FoldPlan, process: Process) -> float:
    """The shortest equal wait after every pass that keeps every start cold enough, to 0.05 s."""
    low, high = 0.1, 0.2
    while peak_c(plan, process, high) > ALLOWED_START_C:
        low, high = high, 2.0 * high
    while high - low > 0.05:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if peak_c(plan, process, middle) > ALLOWED_START_C else (low, middle)
    return high


def row(path: Path, size_mm: float) -> str:
    """One line of the table."""
    goal = read_goal(path, size_mm=size_mm)
    plan = plan_folds(make_net(goal), machine_limits(RIG, MATERIAL), keep_net=True)
    began = time.process_time()
    process = plan_process(plan, RIG, MATERIAL)
    spent = time.process_time() - began
    in_order = job_s(plan, process)
    dark = in_order - process.wait_s
    fixed_s = shortest_fixed_wait(plan, process)
    fixed = dark + fixed_s * process.passes
    made = interleave(plan, RIG, MATERIAL)
    woven = plan_process(made.plan, RIG, MATERIAL)
    alone = plan_process(plan, RIG, MATERIAL, heat="crease")
    fast = plan_process(plan, RIG, MATERIAL, objective="seconds")
    joules = f"{process.energy_j:.0f} → {woven.energy_j:.0f}"
    return (
        f"| {path.stem} | {len(goal.faces)} | {process.passes} | {dark + process.naive_wait_s:.0f} "
        f"| {fixed:.0f} ({fixed_s:.2f} s) | {in_order:.0f} | {made.seconds:.0f} "
        f"| {made.seconds / fixed:.2f} | {made.staged} → {len(woven.folds) - len(process.folds)} "
        f"| {peak_c(plan, alone):.0f} | {woven.peak_start_c:.0f} | {joules} "
        f"| {job_s(plan, fast):.0f} s, {fast.energy_j:.0f} J | {spent:.1f} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--meshes", type=Path, nargs="+", required=True)
    parser.add_argument("--size", type=float, default=60.0, help="longest side of every goal, mm")
    chosen = parser.parse_args()
    print(
        "| mesh | faces | passes | cold s | fixed s | in order s | turns s | turns / fixed "
        "| folds in turns → further stages | alone °C | start °C | energy J | prefer seconds | cpu s |"
    )
    print("|---" * 14 + "|")
    for path in chosen.meshes:
        print(row(path, chosen.size), flush=True)


if __name__ == "__main__":
    main()
