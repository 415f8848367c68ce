"""``blossom bend``: the answer, its JSON, and what is refused."""

from __future__ import annotations

import json

import pytest

from rigs.material import load_material
from studio.cli import main
from twin.heating import bend
from twin.section_model import section_bend

SETTING = "bend --material 304 --thickness 0.075 --power 20 --speed 400 --spot 0.12 --absorptivity 0.35"


def answer(capsys, line: str) -> dict:
    assert main([*line.split(), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_the_section_model_answers(capsys):
    values = answer(capsys, f"{SETTING} --temper annealed --passes 1")
    expected = section_bend(load_material("304"), 0.075, 20.0, 400.0, 0.12, absorptivity=0.35)
    assert values["angle_deg"] == pytest.approx(expected.angle_rad[0] * 57.29577951308232)
    assert values["regime"] == "tgm" and values["valid"] is True and values["model"] == "section/1"
    assert 20.0 < values["peak_bottom_c"] < values["peak_top_c"] < 1400.0
    flange = values["flange"]
    assert len(flange["time_s"]) == len(flange["angle_deg"]) > 50
    assert min(flange["angle_deg"]) < 0.0
    assert flange["angle_deg"][-1] == pytest.approx(values["angle_deg"], rel=1e-3)


def test_the_fast_model_answers(capsys):
    values = answer(capsys, f"{SETTING} --passes 7 --model fast")
    one = bend(load_material("304"), 0.075, 20.0, 400.0, spot_mm=0.12, absorptivity=0.35)
    law = sum((1.0 + n / one.half_passes) ** -1.0 for n in range(7))
    assert values["angle_deg"] == pytest.approx(one.angle_rad * 57.29577951308232 * law)
    assert values["model"] == "fast/1" and len(values["pass_angles_deg"]) == 7
    assert values["flange"] == {"time_s": [], "angle_deg": []}


def test_temper_and_material_name_agree(capsys):
    named = answer(capsys, SETTING.replace("304", "304/full-hard"))
    other = answer(capsys, f"{SETTING} --temper full-hard")
    assert named["angle_deg"] == other["angle_deg"] != answer(capsys, SETTING)["angle_deg"]


def test_a_cut_has_no_angle(capsys):
    values = answer(capsys, SETTING.replace("--speed 400", "--speed 40"))
    assert values["angle_deg"] is None and values["valid"] is False and values["regime"] == "cuts"
    assert any("cut" in flag for flag in values["flags"])


def test_below_yield_is_flat(capsys):
    values = answer(capsys, SETTING.replace("--power 20", "--power 0.3"))
    assert abs(values["angle_deg"]) < 1e-3 and values["valid"] is False
    assert any("below yield" in flag for flag in values["flags"])


@pytest.mark.parametrize("model", ["fast", "section"])
def test_text(model, capsys):
    assert main([*SETTING.split(), "--model", model, "--passes", "3"]) == 0
    out = capsys.readouterr().out
    assert "angle" in out and "after 3 passes" in out and "can be used   yes" in out
    assert ("counter-bend" in out) == (model == "section")


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("--thickness 0.075", "--thickness 0", "thickness"),
        ("--power 20", "--power -3", "power"),
        ("--power 20", "--power nan", "power"),
        ("--speed 400", "--speed inf", "speed"),
        ("--absorptivity 0.35", "--absorptivity 1.3", "absorptivity"),
        ("--material 304", "--material 305", "material"),
        ("--material 304", "--material 304/soft", "temper"),
        ("--spot 0.12", "--spot 0.12 --start-c 1200", "start temperature"),
        ("--spot 0.12", "--spot 0.12 --tilt 90", "tilt"),
        ("--spot 0.12", "--spot 0.12 --tilt nan", "tilt"),
        ("--spot 0.12", "--spot 0.12 --passes 0", "passes"),
        ("--spot 0.12", "--spot 0.12 --passes 100000", "passes"),
        ("--spot 0.12", "--spot 0.12 --model exact", "model"),
    ],
)
def test_bad_values_are_named(old, new, word, capsys):
    assert main(SETTING.replace(old, new).split()) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ") and word in err.lower() and "Traceback" not in err
