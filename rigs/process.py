"""The process of a plan: for every cut and fold the setting, passes and waits, with energy and time."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from planner.values import content_sha256

__all__ = ["CutProcess", "FoldProcess", "Process"]


@dataclass(frozen=True, slots=True)
class FoldProcess:
    """How one ``fold`` step is made. Angles in rad, signed: positive = valley.

    Attributes:
        step: index of the plan step.
        crease: net edge.
        from_rad: fold angle before the step.
        to_rad: fold angle that the plan asks for.
        predicted_rad: fold angle that the passes give by the heating model.
        increments_rad: change of the fold angle by each pass, in order.
        waits_s: dark time after each pass, in order; same length.
        power_w: laser power.
        speed_mm_s: speed along the crease.
        length_mm: length of the crease.
        tilt_rad: angle between beam and sheet normal.
        across_mm: 1/e^2 beam radius across the crease.
        fourier: Fourier number of the setting.
        peak_top_c: hottest temperature of the lit side.
        peak_bottom_c: hottest temperature of the other side.
        regime: name of the mechanism, such as ``tgm``.
        energy_j: laser energy of all passes.
        beam_s: seconds with the beam on.
        seconds: duration of passes and waits.
        flags: where the model is used outside its validity, in words.
        start_c: mean temperature of the crease when each pass begins; empty if unknown.
    """

    step: int
    crease: int
    from_rad: float
    to_rad: float
    predicted_rad: float
    increments_rad: tuple[float, ...]
    waits_s: tuple[float, ...]
    power_w: float
    speed_mm_s: float
    length_mm: float
    tilt_rad: float
    across_mm: float
    fourier: float
    peak_top_c: float
    peak_bottom_c: float
    regime: str
    energy_j: float
    beam_s: float
    seconds: float
    flags: tuple[str, ...] = ()
    start_c: tuple[float, ...] = ()

    @property
    def passes(self) -> int:
        """Number of laser passes."""
        return len(self.increments_rad)

    @property
    def wait_s(self) -> float:
        """Mean wait between passes, s; 0 for one pass."""
        return sum(self.waits_s[:-1]) / (self.passes - 1) if self.passes > 1 else 0.0


@dataclass(frozen=True, slots=True)
class CutProcess:
    """How one ``cut`` or ``release`` step is made.

    Attributes:
        step: index of the plan step.
        power_w: laser power.
        speed_mm_s: speed along the cut.
        passes: how often each path is cut over.
        length_mm: length of the paths, counted once.
        energy_j: laser energy.
        beam_s: seconds with the beam on.
        flags: what is doubtful about the setting, in words.
    """

    step: int
    power_w: float
    speed_mm_s: float
    passes: int
    length_mm: float
    energy_j: float
    beam_s: float
    flags: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Process:
    """Settings for every step of a plan that needs the laser.

    Attributes:
        folds: one per ``fold`` step, in order.
        cuts: one per ``cut`` and ``release`` step, in order.
        model: name and version of the heating model.
        calibration: ``none`` or ``fitted``, from the material.
        grade: grade of the angles: A measured, B literature, C guess.
        material: name and temper.
        absorptivity: absorbed share of the light.
        thickness_mm: of the sheet.
        rotary_s: planned time of rotations.
        plan_wait_s: waits that the plan itself asks for.
        naive_wait_s: waits if every crease were left to cool to 30 °C after each pass, at least.
        heat: where start temperatures come from: ``net``, the field in the flat net with the heat of all
            passes before, or ``crease``, each crease alone.
        allowed_start_c: highest mean temperature of a crease when a pass begins.
        scatter: relative scatter of the angle from sheet to sheet, crease to crease and pass to pass.
        flags: validity flags, each once, in words.
    """

    folds: tuple[FoldProcess, ...]
    cuts: tuple[CutProcess, ...]
    model: str
    calibration: str
    grade: str
    material: str
    absorptivity: float
    thickness_mm: float
    rotary_s: float = 0.0
    plan_wait_s: float = 0.0
    naive_wait_s: float = 0.0
    heat: str = "crease"
    allowed_start_c: float = 0.0
    scatter: tuple[float, float, float] = (0.10, 0.05, 0.08)
    flags: tuple[str, ...] = field(default=())

    @cached_property
    def energy_j(self) -> float:
        """Laser energy of all cuts and folds, J."""
        return sum(f.energy_j for f in self.folds) + sum(c.energy_j for c in self.cuts)

    @cached_property
    def seconds(self) -> float:
        """Time of passes, waits, cuts and rotations, without dark travel (the job knows that), s."""
        laser = sum(f.seconds for f in self.folds) + sum(c.beam_s for c in self.cuts)
        return laser + self.rotary_s + self.plan_wait_s

    @cached_property
    def passes(self) -> int:
        """Number of fold passes."""
        return sum(f.passes for f in self.folds)

    @cached_property
    def wait_s(self) -> float:
        """Dark time after passes in which creases cool, s."""
        return sum(sum(f.waits_s) for f in self.folds)

    @cached_property
    def peak_start_c(self) -> float:
        """Highest mean temperature of a crease when a pass begins, °C; 0 without passes."""
        return max((max(f.start_c) for f in self.folds if f.start_c), default=0.0)

    @cached_property
    def fold_at(self) -> dict[int, FoldProcess]:
        """Plan step → its fold process."""
        return {f.step: f for f in self.folds}

    @cached_property
    def cut_at(self) -> dict[int, CutProcess]:
        """Plan step → its cut process."""
        return {c.step: c for c in self.cuts}

    @cached_property
    def passes_of_crease(self) -> dict[int, int]:
        """Net edge → passes of all its fold steps."""
        total: dict[int, int] = {}
        for fold in self.folds:
            total[fold.crease] = total.get(fold.crease, 0) + fold.passes
        return total

    @cached_property
    def sha256(self) -> str:
        """Content hash of the whole process table."""
        return content_sha256(
            "process/1", self.model, self.calibration, self.grade, self.material, self.absorptivity,
            self.thickness_mm, repr(self.scatter), self.heat, self.allowed_start_c, repr(self.folds),
            repr(self.cuts),
        )  # fmt: skip
