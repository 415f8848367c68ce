"""Rig profiles: what a machine is, checked strictly, with the place of every mistake named."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import Any, Literal

import msgspec

from rigs.dialects import Dialect
from rigs.errors import ProfileError
from rigs.profile_text import all_mistakes, parse_profile, profile_names, profile_text
from rigs.rig_checks import mistakes

__all__ = [
    "Axes", "Clear", "Controller", "Grade", "Head", "Laser", "Pilot", "Rig", "RigName", "Rotary", "Safety",
    "SheetHolder", "load_rig", "parse_rig", "rig_names",
]  # fmt: skip

Span = tuple[float, float]
Triple = tuple[float, float, float]


class Profile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Base of every section: frozen, and a key that it does not know is a mistake."""


class RigName(Profile, frozen=True, kw_only=True):
    """``[rig]``: the name and what a person should know."""

    name: str
    notes: str = ""


class Controller(Profile, frozen=True, kw_only=True):
    """``[controller]``: the firmware and how to reach it.

    Attributes:
        dialect: firmware family; checked against ``$I``, never chosen by a guess.
        url: default port; not part of the rig's hash.
        baud: bits per second.
        rx_bytes: receive buffer of the controller, bytes.
        line_chars: longest line that it accepts.
        resets_on_open: the board resets when the port is opened (position is lost).
        homing: ``required`` | ``manual-zero`` (a person sets the zero) | ``none``.
        g54_mm: work offset G54 that ``$#`` must report, in the order of the axes; rig coordinates are G54.
        expect: ``$`` settings that are read back; a mismatch refuses to arm.
    """

    dialect: Dialect
    url: str = ""
    baud: int = 115200
    rx_bytes: int = 128
    line_chars: int = 79
    resets_on_open: bool = True
    homing: Literal["required", "manual-zero", "none"] = "required"
    g54_mm: tuple[float, ...] = ()
    expect: dict[str, float] = {}


class Axes(Profile, frozen=True, kw_only=True):
    """``[axes]``: linear axes x, y, z. The z coordinate is the height of the focus, not of the nozzle.

    Attributes:
        x_mm: travel, G54 coordinates; y_mm and z_mm alike (equal ends: the axis is fixed there).
        max_mm_s: top speed of x, y, z.
        accel_mm_s2: acceleration of x, y, z.
        steps_per_mm: of x, y, z.
        max_step_hz: fastest step rate that the controller survives.
    """

    x_mm: Span
    y_mm: Span
    z_mm: Span
    max_mm_s: Triple
    accel_mm_s2: Triple
    steps_per_mm: Triple
    max_step_hz: float


class Head(Profile, frozen=True, kw_only=True):
    """``[head]``: how light reaches the part.

    Attributes:
        kind: a moved head (gantry) or mirrors over a still part (galvo).
        telecentric: True when the beam is parallel to ``beam_dir`` everywhere.
        scan_centre_mm: where the rays start when the head is not telecentric.
        focal_mm: focal length of the lens.
        working_distance_mm: from the lowest part of the head down to the focus.
        depth_of_focus_mm: total focus depth.
        spot_mm: 1/e^2 diameter at the focus.
        kerf_mm: width of a cut, measured on a strip; 0 takes that of the spot.
        m2: beam quality factor, 1 is ideal.
        max_incidence_deg: largest angle between beam and sheet normal at a crease.
    """

    kind: Literal["gantry", "galvo"]
    telecentric: bool = True
    beam_dir: Triple = (0.0, 0.0, -1.0)
    scan_centre_mm: Triple = (0.0, 0.0, 0.0)
    focal_mm: float
    working_distance_mm: float
    depth_of_focus_mm: float
    spot_mm: float
    kerf_mm: float = 0.0
    m2: float = 1.5
    max_incidence_deg: float


class Pilot(Profile, frozen=True, kw_only=True):
    """``laser.pilot``: visible light for framing that cannot mark.

    ``low-power`` uses ``M3 S<s>`` (at most ``max_w``), ``aux-output`` uses ``M8``.
    """

    kind: Literal["low-power", "aux-output", "none"] = "none"
    s: float = 0.0
    max_w: float = 0.001


class Laser(Profile, frozen=True, kw_only=True):
    """``[laser]``: source and its power scale.

    Attributes:
        wavelength_nm: of the light.
        max_w: optical power at full scale.
        power_curve: (S, W) pairs, monotone, from (0, 0) to full scale.
        cap_fraction: share of ``max_w`` that no job exceeds.
        mode: ``M4`` (dynamic power) only: with M3 the beam stays on at standstill.
        min_on_ms: shortest useful beam-on time.
        max_beam_s: longest beam time of one block: what may burn unattended if the host vanishes.
        pilot: visible light for framing.
    """

    wavelength_nm: float
    max_w: float
    power_curve: tuple[Span, ...]
    cap_fraction: float = 0.8
    mode: Literal["M4"] = "M4"
    min_on_ms: float = 2.0
    max_beam_s: float = 5.0
    pilot: Pilot = Pilot()

    def s_for_power(self, power_w: float) -> float:
        """S word that gives ``power_w`` watts, by linear interpolation of the power curve.

        Raises:
            ProfileError: if the power is negative, not finite or above full scale.
        """
        if not 0.0 <= power_w <= self.max_w:
            raise ProfileError(f"laser power {power_w} W is not within 0 to {self.max_w} W of this rig")
        for (s0, w0), (s1, w1) in zip(self.power_curve, self.power_curve[1:], strict=False):
            if power_w <= w1:
                return s0 + (s1 - s0) * (power_w - w0) / (w1 - w0) if w1 > w0 else s0
        return self.power_curve[-1][0]

    def power_for_s(self, s: float) -> float:
        """Watts at S word ``s``; the firmware clips S above full scale, and so does this."""
        for (s0, w0), (s1, w1) in zip(self.power_curve, self.power_curve[1:], strict=False):
            if s <= s1:
                return w0 + (w1 - w0) * max(s - s0, 0.0) / (s1 - s0)
        return self.max_w


class Rotary(Profile, frozen=True, kw_only=True):
    """``[rotary]``: the axis that turns the sheet. Sheet coordinates have their origin at ``axis_point_mm``.

    Attributes:
        word: G-code word that turns it.
        kind: ``true-deg`` (its own axis in degrees) or ``swap`` (the plug of the z motor).
        axis_point_mm: G54 coordinates of the origin of the sheet: middle of the work area, on the axis.
        axis_dir: unit vector of the axis.
        sign: +1 when a positive word turns the part right-handed about +x.
        zero: which side is up at 0 degrees.
        units_per_deg: G-code units of a degree (1 for true degrees).
        steps_per_deg: motor steps of a degree.
        range_deg: reachable angles; ``endless`` lifts the limit.
        max_deg_s: top speed; ``accel_deg_s2`` its acceleration.
        backlash_deg: play.
        settle_s: time to wait after a rotation.
    """

    word: Literal["A", "B", "C", "Z"]
    kind: Literal["true-deg", "swap"]
    axis_point_mm: Triple
    axis_dir: Triple = (1.0, 0.0, 0.0)
    sign: Literal[-1, 1] = 1
    zero: Literal["sheet-up"] = "sheet-up"
    units_per_deg: float = 1.0
    steps_per_deg: float
    range_deg: Span
    endless: bool = False
    max_deg_s: float
    accel_deg_s2: float
    backlash_deg: float = 0.0
    settle_s: float


class Clear(Profile, frozen=True, kw_only=True):
    """``[clear]``: height of the highest fixed thing under the part, G54 z of the focus scale, mm."""

    bed_z_mm: float


class SheetHolder(Profile, frozen=True, kw_only=True):
    """``[sheet]``: what the frame takes.

    Attributes:
        max_mm: largest sheet, x and y.
        frame_margin_mm: width of the clamped strip on all sides.
        clamp_height_mm: how far the bars over that strip stand out of the sheet plane, on either side.
        thickness_mm: usual thickness.
        thickness_range_mm: what the clamps hold.
        material: usual material.
        clearance_mm: how far faces are set in from their edges when contact is tested.
        clamp_polygons_mm: clamps that reach over the sheet farther in, as high as the bars; x along the
            rotary axis, y across, from the middle of the work area.
        fiducials_mm: marks that tie sheet to machine, sheet coordinates.
    """

    max_mm: Span
    frame_margin_mm: float
    thickness_mm: float
    thickness_range_mm: Span = (0.02, 1.0)
    material: str
    clearance_mm: float
    clamp_height_mm: float = 0.0
    clamp_polygons_mm: tuple[tuple[Span, ...], ...] = ()
    fiducials_mm: tuple[Span, ...] = ()


class Safety(Profile, frozen=True, kw_only=True):
    """``[safety]``: times and demands of the replay.

    Attributes:
        arm_timeout_s: an armed machine that is not started falls back to disarmed.
        status_hz: how often the machine is asked while it runs.
        status_lost_s: silence after which the machine counts as lost.
        require_dry_run: a dry run of the same job must come before arming.
        door: where the lid switch is.
    """

    arm_timeout_s: float = 120.0
    status_hz: float = 5.0
    status_lost_s: float = 1.0
    require_dry_run: bool = False
    door: Literal["controller-pin", "none"] = "none"


class Grade(Profile, frozen=True, kw_only=True):
    """How well a value is known: A measured, B literature or data sheet, C guess."""

    grade: Literal["A", "B", "C"]
    source: str


class Rig(Profile, frozen=True, kw_only=True):
    """A machine: controller, axes, head, laser, rotary, clearances, sheet holder and safety.

    Coordinates of the profile are G54 work coordinates in mm; z is the height of the focus.
    """

    schema: Literal[1] = 1
    rig: RigName
    controller: Controller
    axes: Axes
    head: Head
    laser: Laser
    rotary: Rotary
    clear: Clear
    sheet: SheetHolder
    safety: Safety = Safety()
    grades: dict[str, Grade] = {}

    @property
    def name(self) -> str:
        """Name of the rig."""
        return self.rig.name

    @property
    def sha256(self) -> str:
        """SHA-256 of the canonical JSON of all that changes what the machine does (no url, notes, grades)."""
        data: dict[str, Any] = msgspec.to_builtins(self)
        del data["grades"], data["controller"]["url"], data["rig"]["notes"]
        return hashlib.sha256(msgspec.json.encode(data, order="deterministic")).hexdigest()

    @property
    def axis_words(self) -> tuple[str, ...]:
        """Words of the controller's axes in the order of its status reports."""
        return ("X", "Y", "Z") if self.rotary.kind == "swap" else ("X", "Y", "Z", self.rotary.word)

    @property
    def has_focus_axis(self) -> bool:
        """True when the job may move the focus height."""
        return self.rotary.word != "Z" and self.axes.z_mm[1] > self.axes.z_mm[0]

    def beam_radius_mm(self, defocus_mm: float = 0.0) -> float:
        """1/e^2 beam radius off the focus: Gaussian beam with Rayleigh range pi w0^2 / (M2 lambda)."""
        waist = self.head.spot_mm / 2.0
        return waist * math.hypot(1.0, defocus_mm * self.beam_spread / waist)

    @property
    def beam_spread(self) -> float:
        """Far from the focus the beam's radius grows by this much per mm: M2 lambda / (pi w0)."""
        return self.head.m2 * self.laser.wavelength_nm * 1e-6 / (math.pi * self.head.spot_mm / 2.0)


def rig_names() -> tuple[str, ...]:
    """Names of the shipped rigs, sorted."""
    return profile_names("profiles")


def load_rig(name_or_path: str | Path) -> Rig:
    """Load a shipped rig by name, or a profile file by path.

    Args:
        name_or_path: a name of ``rig_names()``, or the path of a ``.toml`` file.

    Raises:
        UnknownNameError: no shipped rig has the name.
        ProfileError: the file cannot be read or a value in it is wrong; the message names the place.
    """
    return parse_rig(*profile_text("rig", "profiles", name_or_path))


def rig_mistakes(name_or_path: str | Path) -> tuple[str, ...]:
    """Everything that is wrong with a profile, each as ``$.place: what, and what to do``; empty if nothing.

    Raises:
        UnknownNameError: no shipped rig has the name.
        ProfileError: the file cannot be read.
    """
    text, source = profile_text("rig", "profiles", name_or_path)
    return all_mistakes(text, Rig, mistakes, source)


def parse_rig(text: str, source: str = "rig profile") -> Rig:
    """Read a profile from TOML text; ``source`` names it in messages.

    Raises:
        ProfileError: with the path of the wrong value, such as ``$.laser.power_curve``.
    """
    return parse_profile(text, Rig, mistakes, source)
