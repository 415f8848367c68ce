"""plan.json: round trip, stable bytes, names of the format, and refusals that name the place."""

from __future__ import annotations

import json
from dataclasses import fields, replace

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import FormatError
from planner.fold_plan import Bend, Fold, FoldPlan, Rotate, Wait
from planner.plan_file import plan_bytes, read_plan, write_plan
from tests.planner.hand_plans import plan_for, some_nets

NETS = some_nets()
HASHES = {"goal": "a" * 64, "net_sha256": "b" * 64, "rig": "c" * 64, "material": "d" * 64}


@pytest.fixture(scope="module")
def plan() -> FoldPlan:
    made = plan_for(NETS["cross"], hits=(200, 230, 260))
    return replace(
        made,
        steps=(*made.steps[:-1], Bend((3, 4), ((0.0, 1.0), (2.0, 3.0)), -1.0), Wait(4.5), made.steps[-1]),
    )


def same(a: FoldPlan, b: FoldPlan) -> None:
    for name in ("outline", "vertices", "faces", "frame_faces", "rotary_axis"):
        assert np.array_equal(getattr(a.sheet, name), getattr(b.sheet, name)), name
    assert a.sheet.tabs == b.sheet.tabs
    for field in fields(a.limits):
        one, other = getattr(a.limits, field.name), getattr(b.limits, field.name)
        assert one == (other if field.name == "clamps" else pytest.approx(other, abs=1e-12)), field.name
    assert a.metrics == b.metrics
    assert (a.hidden_max, a.without, a.seed, a.notices) == (b.hidden_max, b.without, b.seed, b.notices)
    assert len(a.steps) == len(b.steps)
    for one, other in zip(a.steps, b.steps, strict=True):
        assert type(one) is type(other)
        for field in fields(one):
            left, right = getattr(one, field.name), getattr(other, field.name)
            if field.name == "to_rad":
                assert left == pytest.approx(right, abs=1e-12)
            else:
                assert left == right
    for one, other in zip(a.blocked, b.blocked, strict=True):
        assert (one.crease, one.by, one.blockers) == (other.crease, other.by, other.blockers)
        for name in ("reached_rad", "wanted_rad", "at_rad"):
            assert getattr(one, name) == pytest.approx(getattr(other, name), abs=1e-12)


def test_round_trip(plan, tmp_path):
    path = tmp_path / "plan.json"
    write_plan(plan, path, HASHES)
    back = read_plan(path, plan.net)
    same(plan, back)
    assert plan_bytes(back, HASHES) == path.read_bytes()  # and from there on not a bit changes


def test_all_that_the_plan_was_made_for_comes_back(plan, tmp_path):
    values = {
        field.name: 1.25 * getattr(plan.limits, field.name) + 0.5
        for field in fields(plan.limits)
        if isinstance(getattr(plan.limits, field.name), float) and not field.name.endswith("_rad")
    }
    limits = replace(
        plan.limits, **values, work_area=(310.0, 210.0), max_tilt_rad=0.5, beam_source=(1.0, -2.0, 300.0),
        clamps=(((0.0, 0.0), (4.0, 0.0), (0.0, 4.0)),),
    )  # fmt: skip
    assert all(getattr(limits, f.name) != getattr(plan.limits, f.name) for f in fields(limits))
    write_plan(replace(plan, limits=limits), tmp_path / "plan.json", HASHES)
    same(replace(plan, limits=limits), read_plan(tmp_path / "plan.json", plan.net))


def test_the_keys_are_those_of_the_format(plan):
    data = json.loads(plan_bytes(plan, HASHES))
    common = ["format", "version", "goal_sha256", "net_sha256", "rig_sha256", "material_sha256", "thickness",
              "clearance", "base_face", "sheet", "rotary", "sight", "substrate", "tabs", "steps", "metrics",
              "blocked"]  # fmt: skip
    assert [key for key in data if not key.startswith("blossom:")] == common
    assert [data[f"{k}_sha256"][0] for k in ("goal", "net", "rig", "material")] == ["a", "b", "c", "d"]
    assert set(data["metrics"]) == {
        "fold_completion", "clipped_faces", "clipped_area", "rotations", "energy_j", "seconds", "shape_rms",
        "shape_rms_rel", "swept_area",
    }  # fmt: skip
    assert set(data["tabs"][0]) == {"edge", "from", "to"}
    assert set(data["blocked"][0]) == {"crease", "reached", "wanted", "by", "with", "at"}
    assert {step["op"] for step in data["steps"]} == {
        "cut",
        "clip",
        "bend",
        "rotate",
        "fold",
        "wait",
        "release",
    }


def test_angles_are_degrees_and_whole_turns_look_whole(plan):
    data = json.loads(plan_bytes(plan, HASHES))
    assert {step["to"] for step in data["steps"] if step["op"] == "rotate"} <= {0.0, 180.0}
    for record, step in zip(data["steps"], plan.steps, strict=True):
        if isinstance(step, Fold):
            assert record["to"] == pytest.approx(np.degrees(step.to_rad), abs=1e-9)


@given(st.floats(-3.1, 3.1))
def test_any_angle_survives(angle):
    plan = plan_for_strip()
    changed = replace(plan, steps=(Rotate(angle), *plan.steps))
    data = plan_bytes(changed, HASHES)
    assert np.radians(json.loads(data)["steps"][0]["to"]) == pytest.approx(angle, abs=1e-12)


_STRIP: list[FoldPlan] = []


def plan_for_strip() -> FoldPlan:
    if not _STRIP:
        _STRIP.append(plan_for(NETS["strip"]))
    return _STRIP[0]


def test_values_of_numpy_are_written_as_plain_ones(plan):
    odd = replace(plan, steps=(Fold(np.int64(plan.blocked[0].crease), np.float64(0.5)), *plan.steps))
    assert json.loads(plan_bytes(odd, HASHES))["steps"][0]["op"] == "fold"


def edited(plan, change) -> bytes:
    data = json.loads(plan_bytes(plan, HASHES))
    change(data)
    return json.dumps(data).encode()


def delete(key):
    return lambda data: data.pop(key)


def put(value, *keys):
    def change(data):
        for key in keys[:-1]:
            data = data[key]
        data[keys[-1]] = value

    return change


BROKEN = {
    "missing key": (delete("steps"), "steps"),
    "unknown key": (put(1, "surprise"), "surprise"),
    "other format": (put("fold", "format"), "format"),
    "newer version": (put(2, "version"), "version"),
    "unknown op": (put("weld", "steps", 0, "op"), r"steps\[0\]"),
    "text for a number": (put("thick", "thickness"), "thickness"),
    "negative thickness": (put(-0.1, "thickness"), "thickness"),
    "share above one": (put(1.5, "sight", "hidden_max"), "hidden_max"),
    "angle out of range": (put(1000.0, "blocked", 0, "at"), r"blocked\[0\].at"),
    "no such triangle": (put([99999], "steps", 1, "faces"), "steps"),
    "other base face": (put(5, "base_face"), "base_face"),
    "substrate without its corner": (put([0, 1, 99999], "substrate", "faces", 0), r"substrate.faces\[0\]"),
    "triangle with two corners": (put([0, 1, 1], "substrate", "faces", 0), r"substrate.faces\[0\]"),
    "frame without its triangle": (put([99999], "blossom:frame_faces"), "frame_faces"),
    "tab on no edge": (put(99999, "tabs", 0, "edge"), r"tabs\[0\].edge"),
    "blocked without crease": (put(99999, "blocked", 0, "crease"), r"blocked\[0\].crease"),
    "three coordinates": (put([1, 2, 3], "sheet", "outline", 0), r"outline\[0\]"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files_are_refused_with_the_place(plan, tmp_path, name):
    change, place = BROKEN[name]
    path = tmp_path / "plan.json"
    if name == "no such triangle":
        clip = next(
            n for n, s in enumerate(json.loads(plan_bytes(plan, HASHES))["steps"]) if s["op"] == "clip"
        )
        change = put([99999], "steps", clip, "faces")
    path.write_bytes(edited(plan, change))
    with pytest.raises(FormatError, match=place) as caught:
        read_plan(path, plan.net)
    assert str(caught.value).startswith("plan.json: ")


def test_a_fold_of_a_cut_edge_is_refused(plan, tmp_path):
    edge = int(np.flatnonzero(plan.net.assignment == "B")[0])
    fold = next(n for n, step in enumerate(plan.steps) if isinstance(step, Fold))
    path = tmp_path / "plan.json"
    path.write_bytes(edited(plan, put(edge, "steps", fold, "crease")))
    with pytest.raises(FormatError, match=rf"steps\[{fold}\].crease is {edge}"):
        read_plan(path, plan.net)


@pytest.mark.parametrize("cut", [0, 1, 50, 0.5, 0.999])
def test_half_written_files_are_refused(plan, tmp_path, cut):
    data = plan_bytes(plan, HASHES)
    path = tmp_path / "plan.json"
    path.write_bytes(data[: int(cut if cut >= 1 else cut * len(data))])
    with pytest.raises(FormatError, match=r"plan.json is not JSON|plan.json: "):
        read_plan(path, plan.net)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_what_is_not_a_number_is_not_written(plan, value):
    with pytest.raises(ValueError, match="metrics"):
        plan_bytes(replace(plan, metrics=replace(plan.metrics, shape_rms=value)), HASHES)


def test_a_plan_without_the_keys_of_the_project_can_be_read(plan, tmp_path):
    def change(data):
        for key in [k for k in data if k.startswith("blossom:")]:
            del data[key]

    path = tmp_path / "plan.json"
    path.write_bytes(edited(plan, change))
    back = read_plan(path, plan.net)
    assert back.limits.thickness == plan.limits.thickness
    assert not back.sheet.frame_faces.any()


def test_the_layout_has_points_on_one_line(plan):
    text = plan_bytes(plan, HASHES).decode()
    assert msgspec.json.decode(text) == json.loads(text)
    assert max(map(len, text.splitlines())) < 4000
    assert '"version": 1' in text
