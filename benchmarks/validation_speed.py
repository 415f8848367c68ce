"""How long the stages of a validation take, in processor time of one core.

``python -m benchmarks.validation_speed MESH …`` plans each mesh and prints a Markdown table: compile (text
and of MuJoCo), sweep, dynamic run, that run over its bare ``mj_step`` calls, and draws of scatter (sum over
the cores) where ``--draws`` asks for them. Told are medians of ``--runs``; before the dynamic ones comes one
for numba to compile.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import mujoco

from benchmarks.bad_plans import the_limits
from planner import make_net, plan_folds, read_goal
from planner.fold_plan import FoldPlan
from twin.driven_run import DrivenRun
from twin.heating_interface import EqualPasses
from twin.loaded_model import LoadedModel, quiet_mujoco
from twin.mjcf_model import CompiledModel, compile_model
from twin.run_settings import RunSettings
from twin.scatter import run_scatter
from twin.scatter_draws import FoldTurn
from twin.sweep import kinematic_sweep
from twin.timeline import turns

T = TypeVar("T")


@dataclass(frozen=True)
class Speed:
    """Seconds of processor time, and how much was done in them.

    Attributes:
        faces: of the net.
        compile_s: text of the model, and MuJoCo's reading of it, median of the runs.
        sweep_s: kinematic sweep, median of the runs.
        run_s: dynamic run without loading the model, median of the runs.
        ratio: its time over that spent inside ``mj_step`` in the same run, by the clock on the wall, which is
            read without a call of the system; median of the runs.
        steps: time steps.
        scatter_s: draws of scatter, 0 if none were asked for.
    """

    faces: int
    compile_s: float
    sweep_s: float
    run_s: float
    ratio: float
    steps: int
    scatter_s: float


class _TimedStep:
    """``mujoco.mj_step`` with a clock around it."""

    def __init__(self) -> None:
        self.real: Any = mujoco.mj_step
        self.seconds, self.calls = 0.0, 0

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        begin = time.perf_counter()
        self.real(model, data)
        self.seconds += time.perf_counter() - begin
        self.calls += 1


def _timed(work: Callable[[], T], runs: int) -> tuple[T, float]:
    """What ``work`` gives, and the median of its processor time."""
    seconds: list[float] = []
    for _ in range(runs):
        begin = time.process_time()
        made = work()
        seconds.append(time.process_time() - begin)
    return made, statistics.median(seconds)


def _compiled(plan: FoldPlan) -> CompiledModel:
    compiled = compile_model(plan)
    compiled.load()
    return compiled


def measure(plan: FoldPlan, draws: int = 0, runs: int = 1) -> Speed:
    """Measure the stages on one plan."""
    clock = time.process_time
    compiled, compile_s = _timed(lambda: _compiled(plan), runs)
    sweep, sweep_s = _timed(lambda: kinematic_sweep(compiled, plan), runs)
    seconds: list[float] = []
    ratios: list[float] = []
    for _ in range(runs + 1):
        loaded = LoadedModel(compiled, plan.net)
        loaded.notice_contacts_only()
        timed = _TimedStep()
        with quiet_mujoco() as messages:
            run = DrivenRun(loaded, plan, sweep, EqualPasses(), RunSettings(), messages)
            mujoco.mj_step = timed
            try:
                begin, wall = clock(), time.perf_counter()
                assert run.play(), "a plan that does not pass says nothing about speed"
                ratios.append((time.perf_counter() - wall) / timed.seconds)
                seconds.append(clock() - begin)
            finally:
                mujoco.mj_step = timed.real
    scatter_s = 0.0
    if draws:
        heating = EqualPasses()
        folds = tuple(
            FoldTurn(t.step, t.crease, t.to_rad, tuple(heating.plastic_increments(t)))
            for t in turns(plan, compiled.side)
            if t.crease >= 0
        )
        run_scatter(plan, folds, draws=1)
        begin = clock()
        run_scatter(plan, folds, draws=draws)
        scatter_s = clock() - begin
    run_s, ratio = statistics.median(seconds[1:]), statistics.median(ratios[1:])
    return Speed(len(plan.net.faces), compile_s, sweep_s, run_s, ratio, timed.calls, scatter_s)


def row(name: str, speed: Speed) -> str:
    """A line of the table."""
    scatter = f"{speed.scatter_s:.0f}" if speed.scatter_s else "–"
    return (
        f"| {name} | {speed.faces} | {speed.compile_s:.2f} | {speed.sweep_s:.2f} | {speed.run_s:.1f} | "
        f"{speed.steps} | {speed.ratio:.2f} | {scatter} |"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line of the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--budget", type=float, default=20.0, help="nominal seconds of planning")
    parser.add_argument("--draws", type=int, default=0, help="draws of scatter")
    parser.add_argument("--runs", type=int, default=3, help="how often each stage is measured")
    chosen = parser.parse_args(arguments)
    print("| net | faces | compile | sweep | dynamic run | steps | over bare mj_step | scatter |")
    print("|---|---|---|---|---|---|---|---|")
    for path in chosen.meshes:
        plan = plan_folds(make_net(read_goal(path)), the_limits(), budget_s=chosen.budget)
        print(row(path.stem, measure(plan, chosen.draws, max(1, chosen.runs))), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
