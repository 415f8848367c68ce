"""The process of a plan: settings, passes and waits for each fold, settings for each cut."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Cut, Fold, FoldPlan, Point, Polyline, Release, Rotate, Wait
from planner.pattern import pattern_of
from rigs.beam_path import between_strokes_s, largest_speed, plan_strokes
from rigs.material import Material
from rigs.motion_time import line_seconds
from rigs.process import CutProcess, FoldProcess, Process
from rigs.rig import Rig
from twin.calibration_scope import calibration_holds
from twin.cooling import pass_times
from twin.cut_setting import cut_setting
from twin.errors import HeatingError
from twin.heating import MODEL_NAME
from twin.net_heat import NetHeat
from twin.pass_law import HeatingModel
from twin.process_table import Chain, Conditions, Objective, SettingTable
from twin.thermal_schedule import PassClock, TimedPasses

__all__ = ["ALLOWED_START_C", "HeatModel", "ProcessMaker", "plan_process", "rotation_s"]

HeatModel = Literal["net", "crease"]
"""``net``: start temperatures from the field in the flat net, with the heat of all passes before.
``crease``: from each crease alone, in a plate without end, cold when its fold begins; quick and too kind."""

ALLOWED_START_C = 200.0
"""A crease may be this warm on average when a pass begins (angle 8 % less than cold)."""

SHORTEST_WAIT_S = 0.1
"""Least dark time between passes: the end where the beam turns round is hit twice at once otherwise."""

COLD_C = 30.0
"""To compare with: the naive way waits after every pass until the crease is as cold as this again."""


def plan_process(
    plan: FoldPlan,
    rig: Rig,
    material: Material,
    *,
    objective: Objective = "joules",
    allowed_start_c: float = ALLOWED_START_C,
    absorptivity: float | None = None,
    heat: HeatModel = "net",
    heating: HeatingModel = "fast",
) -> Process:
    """How every laser step of ``plan`` is made on ``rig`` in ``material``.

    Args:
        plan: the plan.
        rig: the machine.
        material: what the sheet is made of.
        objective: what the search for a setting minimises.
        allowed_start_c: highest mean temperature of a crease when a pass begins.
        absorptivity: absorbed share of the light; the material's value when None.
        heat: where start temperatures and waits come from.
        heating: where angles of passes come from: the closed form, or tables of the layered section.

    Raises:
        HeatingError: if a crease cannot be folded or the sheet not be cut with any setting of the rig, or a
            crease turns away from the beam.
        JobError: if a crease is out of focus.
    """
    from twin.section_law import MODEL_NAME as SECTION_NAME

    share = material.absorptivity_at(rig.laser.wavelength_nm) if absorptivity is None else absorptivity
    maker = ProcessMaker(plan, rig, material, objective, allowed_start_c, share, heating)
    clock = maker.clock() if heat == "net" else None
    folds: list[FoldProcess] = []
    cuts: list[CutProcess] = []
    rotary, rotary_s, waited = 0.0, 0.0, 0.0
    angle: dict[int, float] = {}
    done: dict[int, int] = {}
    for number, step in enumerate(plan.steps):
        if isinstance(step, Rotate):
            seconds = rotation_s(rig, rotary, step.to_rad)
            rotary_s += seconds
            rotary = step.to_rad
        elif isinstance(step, Wait):
            seconds = step.seconds
            waited += seconds
        elif isinstance(step, Fold):
            seen = done.get(step.crease, 0)
            fold, lead_s = maker.fold(number, step, angle.get(step.crease, 0.0), rotary, seen, clock)
            if folds and lead_s > 0.0:
                folds[-1] = _resting(folds[-1], lead_s)
            folds.append(fold)
            angle[step.crease] = fold.to_rad
            done[step.crease] = seen + fold.passes
            continue
        elif isinstance(step, (Cut, Release)):
            cuts.append(maker.cut(number, step.paths))
            seconds = cuts[-1].beam_s
        else:
            continue
        if clock is not None:
            clock.idle(seconds)
    flags = dict.fromkeys(flag for fold in folds for flag in fold.flags)
    flags |= dict.fromkeys(flag for cut in cuts for flag in cut.flags)
    calibration, doubt = calibration_holds(
        material, thickness_mm=plan.limits.thickness, wavelength_nm=rig.laser.wavelength_nm,
        absorptivity=share, heating=heating,
    )  # fmt: skip
    if doubt:
        flags[doubt] = None
    return Process(
        folds=tuple(folds),
        cuts=tuple(cuts),
        model=MODEL_NAME if heating == "fast" else SECTION_NAME,
        calibration=calibration,
        grade=material.grades["forming"].grade if calibration == "fitted" else "C",
        material=f"{material.name} {material.temper_name}",
        absorptivity=share,
        thickness_mm=plan.limits.thickness,
        rotary_s=rotary_s,
        plan_wait_s=waited,
        naive_wait_s=maker.naive_wait_s(folds),
        heat=heat,
        allowed_start_c=maker.allowed_c,
        scatter=material.scatter,
        flags=tuple(flags),
    )


def rotation_s(rig: Rig, from_rad: float, to_rad: float) -> float:
    """Duration of a rotation about the rotary axis with its settling, s."""
    turn = math.degrees(abs(to_rad - from_rad))
    return line_seconds(turn, rig.rotary.max_deg_s, rig.rotary.accel_deg_s2) + rig.rotary.settle_s


def _resting(fold: FoldProcess, seconds: float) -> FoldProcess:
    """``fold`` with a longer rest after its last pass: the next crease is still too warm."""
    if not fold.waits_s:
        return fold
    waits = (*fold.waits_s[:-1], round(fold.waits_s[-1] + seconds, 3))
    return replace(fold, waits_s=waits, seconds=fold.seconds + seconds)


@dataclass(frozen=True)
class _Line:
    """A crease in the sheet: its ends and its length."""

    start: Point
    end: Point
    length: float


class ProcessMaker:
    """Makes the process of single steps; keeps one table of settings for like conditions."""

    def __init__(
        self,
        plan: FoldPlan,
        rig: Rig,
        material: Material,
        objective: Objective,
        allowed_c: float,
        share: float,
        heating: HeatingModel = "fast",
    ) -> None:
        self.plan, self.rig, self.material = plan, rig, material
        self.pattern = pattern_of(plan)
        self.objective: Objective = objective
        self.heating: HeatingModel = heating
        self.allowed_c = min(allowed_c, 20.0 + 0.35 * (material.constants.anneal_c - 20.0))
        self.absorptivity = share
        self.radius = rig.head.spot_mm / 2.0
        self.tables: dict[tuple[int, int, int], SettingTable] = {}
        self.whole = {s.crease: s.to_rad for s in plan.steps if isinstance(s, Fold)}

    def naive_wait_s(self, folds: list[FoldProcess]) -> float:
        """Waits if every pass began on a cold crease, each crease taken alone: a lower bound."""
        known: dict[tuple[float, float], NDArray[np.float64]] = {}
        most: dict[tuple[float, float], int] = {}
        for fold in folds:
            key = (fold.power_w, fold.speed_mm_s)
            most[key] = max(most.get(key, 0), fold.passes)
        total = 0.0
        for fold in folds:
            key = (fold.power_w, fold.speed_mm_s)
            if key not in known:
                line = 1e3 * self.absorptivity * fold.power_w / fold.speed_mm_s
                known[key] = pass_times(
                    self.material, self.plan.limits.thickness, line, most[key], allowed_c=COLD_C,
                    shortest_s=SHORTEST_WAIT_S,
                ).interval_s  # fmt: skip
            total += float(known[key][: max(fold.passes - 1, 0)].sum())
        return total

    def clock(self) -> PassClock:
        """Times passes by the heat in the net, which is cold yet."""
        heat = NetHeat(self.plan.net, self.material, self.plan.limits.thickness)
        return PassClock(heat, self.absorptivity)

    def setting(
        self, number: int, step: Fold, turn: float, rotary: float, goal: float | None = None
    ) -> tuple[Chain, float, float]:
        """Setting of one fold step, seconds of one pass with its dark ways, and seconds of beam in it.

        The setting follows from ``goal``, the angle of the whole crease where a step is only a part of it.
        """
        line = self._crease(number, step.crease)
        table = self._table(line, rotary, *self._footprint(line, abs(math.cos(rotary))))
        chain = table.best(abs(turn if goal is None else goal), line.length, self.objective)
        strokes = plan_strokes(self.rig, line.start, line.end, rotary, chain.speed_mm_s)
        pass_s = sum(s.seconds for s in strokes) + between_strokes_s(self.rig, strokes)
        return chain, pass_s, sum(s.beam_s for s in strokes)

    def fold(
        self, number: int, step: Fold, before: float, rotary: float, done: int, clock: PassClock | None
    ) -> tuple[FoldProcess, float]:
        """The passes of one fold step, and the wait before the first of them."""
        line = self._crease(number, step.crease)
        turn = step.to_rad - before
        cosine = math.cos(rotary)
        if abs(cosine) < 0.05:
            raise HeatingError(
                f"step {number} folds crease {step.crease} with the sheet on edge "
                f"({math.degrees(rotary):.1f} degrees): the beam does not reach it; rotate the sheet first"
            )
        flags: list[str] = []
        if turn * cosine < 0.0:
            if "side" not in self.plan.without:
                raise HeatingError(
                    f"step {number} turns crease {step.crease} away from the beam (rotary at "
                    f"{math.degrees(rotary):.1f} degrees, fold by {math.degrees(turn):.1f}): laser folds "
                    "turn towards it; rotate the sheet first"
                )
            flags.append(f"crease {step.crease} turns away from the beam: real metal turns the other way")
        chain, pass_s, beam_s = self.setting(number, step, turn, rotary, self.whole.get(step.crease))
        if clock is None:
            alone = chain.schedule(abs(turn), pass_s, done)
            schedule = TimedPasses(
                alone.power_w, alone.increments_rad, alone.waits_s, alone.start_c, short=alone.short
            )
        else:
            schedule = clock.fold(chain, step.crease, abs(turn), pass_s, done)
        sign = 1.0 if turn >= 0.0 else -1.0
        if schedule.short:
            flags.append("some folds are smaller than one safe pass: they end up to half a pass off")
        made = FoldProcess(
            step=number,
            crease=step.crease,
            from_rad=before,
            to_rad=step.to_rad,
            predicted_rad=before + sign * math.fsum(schedule.increments_rad),
            increments_rad=tuple(sign * i for i in schedule.increments_rad),
            waits_s=schedule.waits_s,
            power_w=schedule.power_w,
            speed_mm_s=chain.speed_mm_s,
            length_mm=line.length,
            tilt_rad=math.acos(min(abs(cosine), 1.0)),
            across_mm=self._footprint(line, abs(cosine))[0],
            fourier=chain.fourier,
            peak_top_c=chain.peak_top_c,
            peak_bottom_c=chain.peak_bottom_c,
            regime=chain.regime,
            energy_j=len(schedule.increments_rad) * schedule.power_w * line.length / chain.speed_mm_s,
            beam_s=len(schedule.increments_rad) * beam_s,
            seconds=len(schedule.increments_rad) * pass_s + math.fsum(schedule.waits_s),
            flags=(*flags, *chain.flags_after(done + len(schedule.increments_rad))),
            start_c=schedule.start_c,
        )
        return made, schedule.lead_s

    def cut(self, number: int, paths: tuple[Polyline, ...]) -> CutProcess:
        """Power and speed of the paths of one cut: as fast as the rig's cap melts the kerf."""
        limits = self.plan.limits
        power, speed, passes = cut_setting(
            self.rig, self.material, limits.thickness, limits.kerf, self.absorptivity, f"step {number}"
        )
        burnt = self.pattern.paths(paths)
        length = sum(math.dist(a, b) for path in burnt for a, b in itertools.pairwise(path))
        return CutProcess(
            step=number,
            power_w=power,
            speed_mm_s=speed,
            passes=passes,
            length_mm=length,
            energy_j=power * passes * length / speed,
            beam_s=passes * length / speed,
            flags=() if passes == 1 else (f"cuts need {passes} passes: try them on a scrap strip",),
        )

    def _crease(self, number: int, crease: int) -> _Line:
        if crease not in self.pattern.creases:
            raise HeatingError(
                f"step {number} folds net edge {crease}, which joins no face to its parent: the plan does "
                "not belong to this net"
            )
        a, b = self.pattern.creases[crease]
        return _Line(a, b, math.dist(a, b))

    def _footprint(self, line: _Line, cosine: float) -> tuple[float, float]:
        """1/e² radius of the beam on the metal, across and along a crease, mm.

        The sheet leans about x, so the footprint is longer by 1 / cos in y only.
        """
        ux, uy = (line.end[0] - line.start[0]) / line.length, (line.end[1] - line.start[1]) / line.length
        across = self.radius * math.hypot(uy, ux / cosine)
        along = self.radius * math.hypot(ux, uy / cosine)
        return across, along

    def _table(self, line: _Line, rotary: float, across: float, along: float) -> SettingTable:
        """Settings for a crease; footprints within 5 % and speed limits within 20 % share one table."""
        top = min(self.rig.axes.max_mm_s[:2])
        speed = min(largest_speed(self.rig, line.start, line.end, rotary), top)
        key = (
            round(math.log(across / self.radius) / 0.05),
            round(math.log(along / self.radius) / 0.05),
            math.ceil(math.log(top / speed) / math.log(1.2) - 1e-9),
        )
        if key not in self.tables:
            laser = self.rig.laser
            self.tables[key] = SettingTable(
                Conditions(
                    material=self.material,
                    thickness_mm=self.plan.limits.thickness,
                    absorptivity=self.absorptivity,
                    across_mm=self.radius * math.exp(0.05 * key[0]),
                    along_mm=self.radius * math.exp(0.05 * key[1]),
                    largest_w=laser.cap_fraction * laser.max_w,
                    largest_mm_s=top * 1.2 ** -key[2],
                    allowed_c=self.allowed_c,
                    shortest_wait_s=SHORTEST_WAIT_S,
                ),
                self.heating,
            )
        return self.tables[key]
