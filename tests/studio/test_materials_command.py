"""``blossom materials``: list, show and check."""

from __future__ import annotations

import json

import pytest

from rigs.material import load_material, material_names
from rigs.profile_writer import profile_toml
from studio.cli import main


def test_the_list_has_all_of_them(capsys):
    assert main(["materials", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["materials"]
    assert [row["name"] for row in rows] == list(material_names()) and len(rows) >= 8


def test_a_metal_is_shown_with_sources_and_grades(capsys):
    assert main(["materials", "show", "304/full-hard"]) == 0
    out = capsys.readouterr().out
    for grade in load_material("304").grades.values():
        assert f"{grade.grade}: {grade.source}" in out
    assert "full-hard (used)" in out and "conductivity" not in out.splitlines()[0]
    assert load_material("304/full-hard").sha256 in out
    assert main(["materials", "show", "304", "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["material"]["table"]["temperature_c"][0] == 20.0
    assert values["sha256"] == load_material("304").sha256


def test_a_profile_without_mistakes(tmp_path, capsys):
    (tmp_path / "mine.toml").write_text(profile_toml(load_material("316")))
    assert main(["materials", "check", str(tmp_path / "mine.toml")]) == 0
    assert "no mistake found" in capsys.readouterr().out


def test_every_mistake_of_a_profile_is_named(tmp_path, capsys):
    text = profile_toml(load_material("316"))
    text = text.replace("at_1064nm = 0.36", "at_1064nm = 1.36").replace("poisson = 0.29", "poisson = 0.7")
    (tmp_path / "mine.toml").write_text(text)
    assert main(["materials", "check", str(tmp_path / "mine.toml"), "--json"]) == 1
    mistakes = json.loads(capsys.readouterr().out)["mistakes"]
    assert any("absorptivity" in m for m in mistakes) and any("poisson" in m for m in mistakes)
    assert main(["materials", "check", str(tmp_path / "mine.toml")]) == 1
    assert f"{len(mistakes)} mistakes" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("line", "word"),
    [
        ("materials list 304", "did you mean blossom materials show"),
        ("materials show", "needs a metal"),
        ("materials show 305", "305"),
        ("materials check none.toml", "none.toml"),
        ("materials burn", "burn"),
    ],
)
def test_bad_usage_is_named(line, word, capsys):
    assert main(line.split()) == 2
    err = capsys.readouterr().err
    assert word in err and "Traceback" not in err
