"""``blossom testgrid``: a strip that is burnt on the emulator, filled in by the model, and fitted."""

from __future__ import annotations

import csv
import json
import xml.etree.ElementTree as ElementTree
from collections import Counter

import numpy as np
import pytest

from rigs.job_file import read_job
from rigs.journal import read_journal
from rigs.material import load_material
from studio.cli import main
from studio.manifest import read_manifest
from twin.calibration_table import BurntCrease
from twin.pass_fit import predict

TRUE = {"absorptivity": 0.41, "threshold": 6.0, "half_passes": 70.0}


@pytest.fixture(scope="module")
def burnt(tmp_path_factory):
    folder = tmp_path_factory.mktemp("strip")
    line = "testgrid --material 304 --thickness 0.1 --passes 1,4,9 -q -o"
    assert main([*line.split(), str(folder / "strip")]) == 0
    assert main(["replay", str(folder / "strip"), "--port", "emulator", "--arm", "-q"]) == 0
    return folder / "strip"


def test_the_emulator_burns_every_row_as_it_stands_in_the_table(burnt):
    job = read_job(burnt / "job.json", burnt / "job.gcode")
    journal = read_journal(burnt / "journal-001.jsonl")
    assert journal.outcome == "complete" and journal.emulated
    done = Counter(job.blocks[n].crease for n in journal.done if job.blocks[n].kind == "pass")
    with (burnt / "strip.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 24
    for row in rows:
        assert done[int(row["id"])] == int(row["passes"])
        block = next(b for b in job.blocks if b.crease == int(row["id"]))
        assert block.power_w == pytest.approx(float(row["power_w"]), rel=0.01)
        assert block.speed_mm_s == pytest.approx(float(row["speed_mm_s"]), rel=1e-3)
        assert row["angle_deg"] == "" and row["note"].startswith("expected ")


def test_filled_in_and_fitted_it_gives_the_parameters_back(burnt, tmp_path, capsys):
    with (burnt / "strip.csv").open() as file:
        rows = list(csv.DictReader(file))
    creases = [
        BurntCrease(n, float(r["power_w"]), float(r["speed_mm_s"]), 0.1, 0.1, int(r["passes"]), 20.0, 0.0)
        for n, r in enumerate(rows)
    ]
    angles = predict(load_material("304"), creases, 0.1, **TRUE)
    angles *= np.exp(0.05 * np.random.default_rng(7).standard_normal(len(rows)))
    with (tmp_path / "filled.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        for row, angle in zip(rows, angles, strict=True):
            writer.writerow({**row, "angle_deg": f"{angle:.2f}"})
    capsys.readouterr()
    line = ["calibrate", str(tmp_path / "filled.csv"), "--material", "304", "--thickness", "0.1", "--json"]
    assert main([*line, "-o", str(tmp_path / "mine.toml")]) == 0
    values = {p["name"]: p for p in json.loads(capsys.readouterr().out)["parameters"]}
    assert values["absorptivity"]["value"] == pytest.approx(TRUE["absorptivity"], rel=0.1)
    for name, truth in TRUE.items():
        if values[name]["fitted"]:
            assert abs(np.log(values[name]["value"] / truth)) < 4.0 * values[name]["sigma_relative"]


def test_the_bundle_is_whole_and_its_picture_has_every_piece(burnt):
    manifest = read_manifest(burnt)
    assert set(manifest.files) == {
        "rig.toml", "material.toml", "job.json", "job.gcode", "strip.svg", "validation.json",
    }  # fmt: skip
    check = json.loads((burnt / "validation.json").read_text())
    job = read_job(burnt / "job.json")
    assert check["verdict"] == "pass" and check["process"] == "uncalibrated"
    assert check["job_sha256"] == job.sha256 and check["material_sha256"] == manifest.material["sha256"]
    tree = ElementTree.parse(burnt / "strip.svg").getroot()  # noqa: S314  our own file
    texts = [text.text for text in tree.iter("{http://www.w3.org/2000/svg}text")]
    assert {str(n) for n in range(1, 25)} <= set(texts)


def test_measured_figures_do_not_change_the_bundle_and_are_not_overwritten(burnt, capsys):
    table = burnt / "strip.csv"
    before = table.read_text()
    try:
        table.write_text(before.replace(",20,,", ",20,1.5,", 1))
        assert main(["replay", str(burnt), "--port", "emulator", "--dry-run", "-q"]) == 0
        assert "24 fingers" in capsys.readouterr().out
        assert main(["testgrid", "-o", str(burnt), "--force", "-q"]) == 2
        assert "holds measured figures" in capsys.readouterr().err
    finally:
        table.write_text(before)


def test_stages_of_a_part_say_what_is_missing(burnt, capsys):
    for stage in ("validate", "plan", "report"):
        assert main([stage, str(burnt), "-q"]) == 2
        err = capsys.readouterr().err
        assert "has no" in err and "Traceback" not in err


def test_windows_for_the_kerf(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    line = "testgrid --kind kerf --powers 15,19 --speeds 20,40 --repeats 2 -o kerf --json"
    assert main(line.split()) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["pieces"] == 8 and values["piece_kind"] == "kerf"
    rows = (tmp_path / "kerf" / "strip.csv").read_text().splitlines()
    filled = [rows[0]]
    for n, row in enumerate(rows[1:]):
        cells = row.split(",")
        if cells[2] == "20":
            cells[5], cells[6] = f"{7.9 - 0.005 * (n % 2):.3f}", "8.12"
        filled.append(",".join(cells))
    (tmp_path / "filled.csv").write_text("\n".join(filled) + "\n")
    assert main(["calibrate", "filled.csv", "--material", "304", "--thickness", "0.1"]) == 0
    out = capsys.readouterr().out
    assert "does not cut through (0 of 2)" in out and "set kerf_mm = 0.11" in out
    assert main(["calibrate", "filled.csv", "--material", "304", "--thickness", "0.1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["kerf_mm"] == pytest.approx(0.11, abs=0.003)


@pytest.mark.parametrize(
    ("more", "code", "word"),
    [
        ("--powers 6,x", 2, "--powers 6,x"),
        ("--powers -6", 2, "--powers"),
        ("--powers nan", 2, "--powers"),
        ("--passes 1.5", 2, "whole numbers"),
        ("--repeats 0", 2, "repeats"),
        ("--repeats 300", 1, "do not fit"),
        ("--powers 19 --speeds 20", 1, "would cut"),
        ("--powers 50 --speeds 300", 1, "50 W is not within"),
        ("--thickness 3", 2, "clamps"),
        ("--width 0.2", 1, "width"),
        ("--kind melt", 2, "kind"),
        ("--rig none", 2, "none"),
    ],
)
def test_what_cannot_be_burnt_is_said(tmp_path, monkeypatch, more, code, word, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["testgrid", *more.split(), "-q"]) == code
    err = capsys.readouterr().err
    assert word in err and "Traceback" not in err
    assert list(tmp_path.iterdir()) == []
