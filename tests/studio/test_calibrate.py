"""``blossom calibrate``: files, JSON and what is refused."""

from __future__ import annotations

import json
import shutil
import xml.etree.ElementTree as ElementTree

import pytest

from models.goals import goal_path
from rigs.material import load_material
from studio.cli import main
from tests.twin.burnt_tables import THICKNESS, TRUE, burnt


@pytest.fixture
def table(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = [
        f"{n},{r.power_w:g},{r.speed_mm_s:g},0.1,{r.passes},{r.angle_deg:.3f}"
        for n, r in enumerate(burnt(noise=0.03, seed=5).rows, 1)
    ]
    path = tmp_path / "strip.csv"
    path.write_text("id,power_w,speed_mm_s,spot_mm,passes,angle_deg\n" + "\n".join(rows) + "\n")
    return path


LINE = f"calibrate strip.csv --material 304 --thickness {THICKNESS}"


def test_it_writes_a_material_that_other_commands_take(table, tmp_path, capsys):
    assert main([*LINE.split(), "-o", "my.toml", "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["file"] == "my.toml" and values["grade"] == "A"
    fitted = load_material(str(tmp_path / "my.toml"))
    assert values["sha256"] == fitted.sha256
    assert fitted.absorptivity.at_1064nm == pytest.approx(TRUE["absorptivity"], rel=0.1)
    assert len(values["rows"]) == 32 and values["left_out"]["groups"] == 8
    setting = "--thickness 0.1 --power 9 --speed 100 --spot 0.1 --model fast --json"
    assert main(["bend", "--material", "my.toml", *setting.split()]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["calibrated"] is True and answer["setting"]["absorptivity"] == pytest.approx(
        fitted.absorptivity.at_1064nm
    )


def test_the_picture_is_whole(table, tmp_path):
    assert main([*LINE.split(), "-o", "my.toml"]) == 0
    tree = ElementTree.parse(tmp_path / "my.svg").getroot()  # noqa: S314  our own file
    circles = tree.findall("{http://www.w3.org/2000/svg}circle")
    assert len(circles) == 3 * 32  # fitted, left out, over passes
    assert len(tree.findall("{http://www.w3.org/2000/svg}polyline")) == 8


def test_it_says_what_it_found(table, tmp_path, capsys):
    assert main(LINE.split()) == 0
    out = capsys.readouterr().out
    assert (tmp_path / "strip-304.toml").is_file() and "strip-304.toml" in out
    for word in ("absorptivity", "threshold", "half passes", "left out", "grade", "±"):
        assert word in out


def test_files_are_not_replaced_unasked(table, tmp_path, capsys):
    (tmp_path / "my.toml").write_text("mine\n")
    assert main([*LINE.split(), "-o", "my.toml"]) == 2
    assert "is there already" in capsys.readouterr().err and (tmp_path / "my.toml").read_text() == "mine\n"
    assert main([*LINE.split(), "-o", "my.toml", "--force"]) == 0
    assert load_material(str(tmp_path / "my.toml")).calibration.status == "fitted"


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("strip.csv", "none.csv", "none.csv"),
        ("--material 304", "--material 305", "305"),
        ("--material 304", "--material 304 --temper soft", "soft"),
        ("--thickness 0.1", "--thickness 0", "thickness"),
        ("--thickness 0.1", "--thickness nan", "thickness"),
        ("--thickness 0.1", "--thickness 0.1 -o my.json", ".toml"),
        ("--thickness 0.1", "--thickness 0.1 --wavelength 450", "450"),
        ("--thickness 0.1", "--thickness 0.1 --leave-out row", "leave-out"),
    ],
)
def test_bad_values_are_named(table, tmp_path, old, new, word, capsys):
    before = sorted(p.name for p in tmp_path.iterdir())
    assert main(LINE.replace(old, new).split()) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ") and word in err and "Traceback" not in err
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_a_folder_that_cannot_be_written_leaves_nothing(table, tmp_path, capsys):
    assert main([*LINE.split(), "-o", "nowhere/my.toml"]) == 2
    assert "nowhere" in capsys.readouterr().err and not (tmp_path / "nowhere").exists()


def test_a_temper_by_name_goes_into_the_bundle(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(goal_path("flower"), tmp_path / "part.obj")
    assert main(["net", "part.obj", "--size", "20", "--material", "304/half-hard", "-o", "part", "-q"]) == 0
    material = load_material(str(tmp_path / "part" / "material.toml"))
    assert material == load_material("304/half-hard")
