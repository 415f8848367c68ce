"""Laser settings, start temperatures and turns from the command line, kept by every later stage."""

from __future__ import annotations

import json
import shutil

import pytest

from models.goals import goal_path
from studio.cli import main
from studio.manifest import read_manifest


def made(folder, capsys, *flags):
    shutil.copy(goal_path("crown"), folder / "part.obj")
    assert main(["make", str(folder / "part.obj"), "-o", str(folder / "out"), "-q", "--json", *flags]) == 0
    return json.loads(capsys.readouterr().out)


def test_turns_save_time_and_the_stages_keep_the_choice(tmp_path, capsys):
    (tmp_path / "turns").mkdir()
    plain = made(tmp_path, capsys, "--start-temperature", "90")
    turns = made(tmp_path / "turns", capsys, "--start-temperature", "90", "--take-turns")
    assert turns["verdict"] == plain["verdict"] == "pass"
    assert turns["seconds"] < plain["seconds"]
    assert turns["completion"] == plain["completion"]
    for figures in (plain, turns):
        heat = figures["heat"]
        assert heat["peak_start_c"] <= 90.5
        assert heat["allowed_start_c"] == 90.0
        assert heat["wait_s"] < heat["naive_wait_s"]
    assert any("take turns" in notice for notice in turns["notices"])
    bundle = tmp_path / "turns" / "out"
    before = (bundle / "job.gcode").read_bytes(), read_manifest(bundle).process
    assert main(["job", str(bundle), "-q", "--json"]) == 0
    assert ((bundle / "job.gcode").read_bytes(), read_manifest(bundle).process) == before
    assert before[1]["start_c"] == 90.0


def test_settings_for_seconds_are_other_settings(tmp_path, capsys):
    (tmp_path / "fast").mkdir()
    frugal, fast = made(tmp_path, capsys), made(tmp_path / "fast", capsys, "--prefer", "seconds")
    assert fast["seconds"] <= frugal["seconds"]
    assert fast["energy_j"] != frugal["energy_j"]
    assert read_manifest(tmp_path / "fast" / "out").process["prefer"] == "seconds"


@pytest.mark.parametrize("degrees", ["20", "29.9"])
def test_a_start_at_room_temperature_is_refused(degrees, tmp_path, capsys):
    mesh = str(goal_path("bracket"))
    line = ["make", mesh, "-o", str(tmp_path / "out"), "-q", "--start-temperature", degrees]
    assert main(line) == 2
    err = capsys.readouterr().err
    assert f"--start-temperature {degrees}" in err
    assert "30 °C or more" in err
    assert not (tmp_path / "out").exists()
