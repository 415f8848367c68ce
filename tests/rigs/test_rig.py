"""Rig profiles: every mistake is named by its place, and the shipped rigs have none."""

from __future__ import annotations

import importlib.resources
import pickle
import re
import tomllib

import msgspec
import pytest

from rigs.errors import ProfileError, UnknownNameError
from rigs.limits import machine_limits
from rigs.material import load_material
from rigs.rig import Rig, load_rig, parse_rig, rig_names
from rigs.rig_checks import mistakes

TEXT = (importlib.resources.files("rigs") / "profiles" / "grbl-4axis.toml").read_text("utf-8")

MISTAKES = [
    ('name = "grbl-4axis"', "name = 5", "$.rig.name: "),
    ("max_w = 20.0", 'max_w = "20"', "$.laser.max_w: "),
    ("max_w = 20.0", "max_w = nan", "$.laser.max_w: must be a finite number"),
    ("max_w = 20.0", "max_w = 25.0", "$.laser.power_curve: must end at max_w = 25 W"),
    ("[100.0, 1.1]", "[100.0, -1.1]", "$.laser.power_curve: S must rise"),
    ("[100.0, 1.1]", "[0.0, 0.0]", "$.laser.power_curve: S must rise"),
    ("[[0.0, 0.0],", "[[1.0, 0.0],", "$.laser.power_curve: expected at least two"),
    ("cap_fraction = 0.95", "cap_fraction = 1.5", "$.laser.cap_fraction: "),
    ("max_beam_s = 5.0", "max_beam_s = 500.0", "$.laser.max_beam_s: "),
    ('mode = "M4"', 'mode = "M3"', "$.laser.mode: "),
    ("baud = 115200", "boud = 115200", "$.controller: "),
    ("baud = 115200", "baud = 1" + "0" * 40, "$.controller.baud: no controller has 1e+40"),
    ("max_w = 20.0", "max_w = " + "9" * 400, "$.laser.max_w: "),
    ("max_w = 20.0", "max_w = " + "[" * 5000 + "]" * 5000, "nested too deeply"),
    ("rx_bytes = 255", "rx_bytes = 20", "$.controller.rx_bytes: "),
    ('"$32" = 1 ', '"$32" = 0 ', '$.controller.expect: needs "$32" = 1'),
    ('"$30" = 1000', '"$30" = 255', '$.controller.expect: "$30"'),
    ('"$20" = 1 ', '"soft" = 1 ', "$.controller.expect.soft: "),
    ("g54_mm = [-400.0, -300.0, -240.0, 0.0]", "g54_mm = [0.0]", "$.controller.g54_mm: expected 4"),
    ("x_mm = [0.0, 400.0]", "x_mm = [400.0, 0.0]", "$.axes.x_mm: "),
    ("steps_per_mm = [80.0,", "steps_per_mm = [800.0,", "$.axes.max_mm_s[0]: "),
    ("accel_mm_s2 = [2000.0,", "accel_mm_s2 = [0.0,", "$.axes.accel_mm_s2[0]: must be more than 0"),
    ("spot_mm = 0.1", "spot_mm = 0.0", "$.head.spot_mm: must be more than 0"),
    ("m2 = 1.5", "m2 = 0.5", "$.head.m2: "),
    ("beam_dir = [0.0, 0.0, -1.0]", "beam_dir = [0.0, 0.0, 1.0]", "$.head.beam_dir: "),
    ("working_distance_mm = 220.0", "working_distance_mm = 120.0", "$.head.working_distance_mm: "),
    ("axis_dir = [1.0, 0.0, 0.0]", "axis_dir = [1.0, 1.0, 0.0]", "$.rotary.axis_dir: "),
    ("axis_dir = [1.0, 0.0, 0.0]", "axis_dir = [-1.0, 0.0, 0.0]", "$.rotary.axis_dir: write"),
    ('word = "A"', 'word = "Z"', "$.rotary.word: "),
    ("units_per_deg = 1.0", "units_per_deg = 2.0", "$.rotary.units_per_deg: "),
    ("max_deg_s = 60.0", "max_deg_s = 600.0", "$.rotary.max_deg_s: "),
    ("range_deg = [-", "range_deg = [1", "$.rotary.range_deg: "),
    ("_point_mm = [200.0, 150.0, 120.0]", "_point_mm = [200.0, 150.0, 500.0]", "$.rotary.axis_point_mm[2]"),
    ("_point_mm = [200.0, 150.0, 120.0]", "_point_mm = [200.0, 140.0, 120.0]", "$.sheet.max_mm[1]: "),
    ("bed_z_mm = -60.0", "bed_z_mm = 0.0", "$.clear.bed_z_mm: "),
    ("frame_margin_mm = 10.0", "frame_margin_mm = 150.0", "$.sheet.max_mm: nothing is left"),
    ("thickness_mm = 0.1\n", "thickness_mm = 0.9\n", "$.sheet.thickness_mm: "),
    ("schema = 1", "schema = 2", "$.schema: "),
    ("schema = 1", "schema = ", "not valid TOML"),
]  # fmt: skip


@pytest.mark.parametrize("name", rig_names())
def test_shipped_rigs_have_no_mistake_and_grade_every_section(name: str) -> None:
    rig = load_rig(name)
    assert list(mistakes(rig)) == []
    assert rig.name == name
    sections = {"controller", "axes", "head", "laser", "rotary", "clear", "sheet", "safety"}
    assert sections <= set(rig.grades), "each section says how well it is known"
    fields = msgspec.to_builtins(rig)
    for place in rig.grades:
        value = fields
        for key in place.split("."):
            assert key in value, f"{name}: graded value {place} does not exist"
            value = value[key]


@pytest.mark.parametrize(("old", "new", "place"), MISTAKES)
def test_each_mistake_is_named_with_its_place(old: str, new: str, place: str) -> None:
    assert TEXT.count(old) >= 1
    with pytest.raises(ProfileError, match=re.escape(place)) as caught:
        parse_rig(TEXT.replace(old, new, 1), "my.toml")
    assert str(caught.value).startswith("my.toml: ")


def test_hash_ignores_what_does_not_matter_and_sees_what_does() -> None:
    rig = parse_rig(TEXT)
    assert len(rig.sha256) == 64
    assert parse_rig(TEXT.replace("/dev/ttyACM0", "/dev/other")).sha256 == rig.sha256
    assert parse_rig(TEXT.replace("20 W fibre source, long", "a longer")).sha256 == rig.sha256
    moved = "axis_point_mm = [200.01, 150.0, 120.0]"
    text = TEXT.replace("axis_point_mm = [200.0, 150.0, 120.0]", moved).replace(
        "max_mm = [400.0,", "max_mm = [399.0,"
    )
    assert parse_rig(text).sha256 != parse_rig(TEXT.replace("max_mm = [400.0,", "max_mm = [399.0,")).sha256


def test_hash_does_not_depend_on_the_order_of_keys() -> None:
    data = tomllib.loads(TEXT)
    turned = {
        key: dict(reversed(v.items())) if isinstance(v, dict) else v for key, v in reversed(data.items())
    }
    assert msgspec.convert(turned, Rig).sha256 == parse_rig(TEXT).sha256


def test_unknown_name_lists_the_nearest(tmp_path) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(UnknownNameError, match="did you mean grbl-4axis") as caught:
        load_rig("grbl-4-axis")
    assert isinstance(caught.value, LookupError)
    assert caught.value.choices == rig_names()
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)  # noqa: S301  our own bytes
    with pytest.raises(ProfileError, match="cannot read the rig profile"):
        load_rig(tmp_path / "missing.toml")
    (tmp_path / "odd.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ProfileError, match="not UTF-8"):
        load_rig(str(tmp_path / "odd.toml"))
    (tmp_path / "own.toml").write_text(TEXT, encoding="utf-8")
    assert load_rig(tmp_path / "own.toml") == load_rig("grbl-4axis")


@pytest.mark.parametrize("name", rig_names())
def test_power_curve_and_its_inverse_agree(name: str) -> None:
    laser = load_rig(name).laser
    for share in (0.0, 0.01, 0.3, 0.77, 1.0):
        power = share * laser.max_w
        assert laser.power_for_s(laser.s_for_power(power)) == pytest.approx(power, abs=1e-12)
    assert laser.power_for_s(1e9) == laser.max_w
    for bad in (-1.0, laser.max_w * 1.01, float("nan")):
        with pytest.raises(ProfileError):
            laser.s_for_power(bad)


def test_limits_follow_from_the_rig() -> None:
    rig = load_rig("grbl-4axis")
    limits = machine_limits(rig, load_material("304"))
    assert limits.work_area == (400.0, 300.0)
    assert limits.axis_height == 180.0
    assert limits.lens_height == 220.0
    assert limits.focus_travel == 120.0
    assert rig.head.spot_mm / 2 <= limits.beam_radius < rig.head.spot_mm
    assert limits.bend_width == limits.relief_mm == rig.head.spot_mm
    assert limits.neutral_shift == pytest.approx(0.1 / 3.0)
    assert machine_limits(rig, load_material("304"), 0.3).relief_mm == 0.3
    assert machine_limits(load_rig("grbl-diode-swap"), load_material("304")).focus_travel == 0.0
    with pytest.raises(ProfileError, match="does not fit its clamps"):
        machine_limits(rig, load_material("304"), 2.0)


def test_beam_radius_grows_by_root_two_at_the_rayleigh_range() -> None:
    rig = load_rig("grbl-4axis")
    rayleigh = 3.141592653589793 * 0.05**2 / (1.5 * 1064e-6)
    assert rig.beam_radius_mm(rayleigh) == pytest.approx(0.05 * 2**0.5)
    assert rig.beam_radius_mm() == 0.05


def test_bars_and_clamps_of_the_frame_go_into_the_limits_and_are_checked() -> None:
    rig = load_rig("grbl-4axis")
    corner = ((-200.0, 100.0), (-150.0, 100.0), (-150.0, 150.0))
    held = msgspec.structs.replace(rig.sheet, clamp_height_mm=3.0, clamp_polygons_mm=(corner,))
    limits = machine_limits(msgspec.structs.replace(rig, sheet=held), load_material("304"))
    assert limits.clamp_height == 3.0
    assert limits.clamps == (corner,)
    for value in (-1.0, 80.0):
        sheet = msgspec.structs.replace(rig.sheet, clamp_height_mm=value)
        (line,) = mistakes(msgspec.structs.replace(rig, sheet=sheet))
        assert line.startswith("$.sheet.clamp_height_mm: ")
    sheet = msgspec.structs.replace(rig.sheet, clamp_polygons_mm=(corner[:2],))
    (line,) = mistakes(msgspec.structs.replace(rig, sheet=sheet))
    assert line.startswith("$.sheet.clamp_polygons_mm[0]: ")
