"""The process of a plan: settings, passes and waits for each fold, settings for each cut."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from planner.fold_plan import Cut, Fold, FoldPlan, Point, Polyline, Release, Rotate, Wait
from planner.pattern import pattern_of
from rigs.beam_path import between_strokes_s, largest_speed, plan_strokes
from rigs.material import Material
from rigs.motion_time import line_seconds
from rigs.process import CutProcess, FoldProcess, Process
from rigs.rig import Rig
from twin.errors import HeatingError
from twin.heating import MODEL_NAME
from twin.hot_metal import melting_heat
from twin.process_table import Conditions, Objective, SettingTable

__all__ = ["ALLOWED_START_C", "plan_process"]

ALLOWED_START_C = 200.0
"""A crease may be this warm on average when a pass begins (angle 8 % less than cold)."""

SHORTEST_WAIT_S = 0.1
"""Least dark time between passes: the end where the beam turns round is hit twice at once otherwise."""

MELTING_SHARE = 0.483
"""Largest share of the absorbed power that melts a kerf. Swift-Hook and Gick, Welding J. 52 (1973)."""

CUT_RESERVE = 1.25
"""Cuts get this much more than melting needs. Grade C."""

SLOWEST_CUT_MM_S = 2.0


def plan_process(
    plan: FoldPlan,
    rig: Rig,
    material: Material,
    *,
    objective: Objective = "joules",
    allowed_start_c: float = ALLOWED_START_C,
    absorptivity: float | None = None,
) -> Process:
    """How every laser step of ``plan`` is made on ``rig`` in ``material``.

    Args:
        plan: the plan.
        rig: the machine.
        material: what the sheet is made of.
        objective: what the search for a setting minimises.
        allowed_start_c: highest mean temperature of a crease when a pass begins.
        absorptivity: absorbed share of the light; the material's value when None.

    Raises:
        HeatingError: if a crease cannot be folded or the sheet not be cut with any setting of the rig, or a
            crease turns away from the beam.
        JobError: if a crease is out of focus.
    """
    share = material.absorptivity_at(rig.laser.wavelength_nm) if absorptivity is None else absorptivity
    maker = _Maker(plan, rig, material, objective, allowed_start_c, share)
    folds: list[FoldProcess] = []
    cuts: list[CutProcess] = []
    rotary, rotary_s, waited = 0.0, 0.0, 0.0
    angle: dict[int, float] = {}
    done: dict[int, int] = {}
    for number, step in enumerate(plan.steps):
        if isinstance(step, Rotate):
            turn = math.degrees(abs(step.to_rad - rotary))
            rotary_s += (
                line_seconds(turn, rig.rotary.max_deg_s, rig.rotary.accel_deg_s2) + rig.rotary.settle_s
            )
            rotary = step.to_rad
        elif isinstance(step, Wait):
            waited += step.seconds
        elif isinstance(step, Fold):
            fold = maker.fold(number, step, angle.get(step.crease, 0.0), rotary, done.get(step.crease, 0))
            folds.append(fold)
            angle[step.crease] = fold.to_rad
            done[step.crease] = done.get(step.crease, 0) + fold.passes
        elif isinstance(step, (Cut, Release)):
            cuts.append(maker.cut(number, step.paths))
    flags = dict.fromkeys(flag for fold in folds for flag in fold.flags)
    flags |= dict.fromkeys(flag for cut in cuts for flag in cut.flags)
    if material.calibration.status == "none":
        flags[f"material {material.name} is not calibrated: angles may be 30 % off, burn a test strip"] = None
    return Process(
        folds=tuple(folds),
        cuts=tuple(cuts),
        model=MODEL_NAME,
        calibration=material.calibration.status,
        grade=material.grades["forming"].grade,
        material=f"{material.name} {material.temper_name}",
        absorptivity=share,
        thickness_mm=plan.limits.thickness,
        rotary_s=rotary_s,
        plan_wait_s=waited,
        scatter=material.scatter,
        flags=tuple(flags),
    )


@dataclass(frozen=True)
class _Line:
    """A crease in the sheet: its ends and its length."""

    start: Point
    end: Point
    length: float


class _Maker:
    """Makes the process of single steps; keeps one table of settings for like conditions."""

    def __init__(
        self,
        plan: FoldPlan,
        rig: Rig,
        material: Material,
        objective: Objective,
        allowed_c: float,
        share: float,
    ) -> None:
        self.plan, self.rig, self.material = plan, rig, material
        self.pattern = pattern_of(plan)
        self.objective: Objective = objective
        self.allowed_c = min(allowed_c, 20.0 + 0.35 * (material.constants.anneal_c - 20.0))
        self.absorptivity = share
        self.radius = rig.head.spot_mm / 2.0
        self.tables: dict[tuple[int, int, int], SettingTable] = {}

    def fold(self, number: int, step: Fold, before: float, rotary: float, done: int) -> FoldProcess:
        """The passes of one fold step."""
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
        across, along = self._footprint(line, abs(cosine))
        table = self._table(line, rotary, across, along)
        chain = table.best(abs(turn), line.length, self.objective)
        strokes = plan_strokes(self.rig, line.start, line.end, rotary, chain.speed_mm_s)
        pass_s = sum(s.seconds for s in strokes) + between_strokes_s(self.rig, strokes)
        schedule = chain.schedule(abs(turn), pass_s, done)
        sign = 1.0 if turn >= 0.0 else -1.0
        if schedule.short:
            flags.append("some folds are smaller than one safe pass: they end up to half a pass off")
        return FoldProcess(
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
            across_mm=across,
            fourier=chain.fourier,
            peak_top_c=chain.peak_top_c,
            peak_bottom_c=chain.peak_bottom_c,
            regime=chain.regime,
            energy_j=len(schedule.increments_rad) * schedule.power_w * line.length / chain.speed_mm_s,
            beam_s=len(schedule.increments_rad) * sum(s.beam_s for s in strokes),
            seconds=len(schedule.increments_rad) * pass_s + math.fsum(schedule.waits_s),
            flags=(*flags, *chain.flags),
        )

    def cut(self, number: int, paths: tuple[Polyline, ...]) -> CutProcess:
        """Power and speed of the paths of one cut: as fast as the rig's cap melts the kerf."""
        rig, limits = self.rig, self.plan.limits
        power = rig.laser.cap_fraction * rig.laser.max_w
        needed = melting_heat(self.material) * 1e-6 * limits.thickness * limits.kerf  # J/m
        speed = 1e3 * MELTING_SHARE * self.absorptivity * power / (CUT_RESERVE * needed)
        passes = max(1, math.ceil(SLOWEST_CUT_MM_S / speed))
        if passes > 20:
            raise HeatingError(
                f"step {number} cuts {limits.thickness:g} mm of {self.material.name}: {power:.3g} W would "
                f"need {passes} passes at {SLOWEST_CUT_MM_S:g} mm/s: choose thinner metal or a stronger laser"
            )
        speed = min(speed * passes, 0.5 * min(rig.axes.max_mm_s[:2]))
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
                )
            )
        return self.tables[key]
