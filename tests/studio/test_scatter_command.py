"""``blossom scatter``: same seed, same answer; the bundle is only read; words and JSON agree."""

import json

import pytest

from models.goals import goal_path
from studio.cli import main


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    where = tmp_path_factory.mktemp("scatter")
    part = str(where / "part")
    assert main(["net", str(goal_path("bracket")), "-o", part, "-q"]) == 0
    assert main(["plan", part, "-q"]) == 0
    return where / "part"


def test_the_answer_is_seeded_and_the_bundle_only_read(folder, capsys):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    line = ["scatter", str(folder), "--draws", "45", "--touch-up", "--json", "--seed", "7"]
    assert main(line) == 0
    first = json.loads(capsys.readouterr().out)
    assert main(line) == 0
    assert json.loads(capsys.readouterr().out) == first
    assert before == {path.name: path.read_bytes() for path in folder.iterdir()}
    assert (first["draws"], first["seed"]) == (45, 7)
    for way in ("open_loop", "touched_up"):
        low, high = first[way]["interval"]
        assert 0.0 <= low <= first[way]["probability"] <= high <= 1.0
    assert first["touched_up"]["shape_rms_mm"][1] < first["open_loop"]["shape_rms_mm"][1]
    assert main([*line[:-1], "8"]) == 0
    assert json.loads(capsys.readouterr().out)["open_loop"] != first["open_loop"]


def test_words_without_touching_up(folder, capsys):
    assert main(["scatter", str(folder), "--draws", "20", "-q"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("20 draws")
    assert "% pass (95 % sure:" in text
    assert "touched up" not in text
    assert "creases that matter most" in text


@pytest.mark.parametrize(
    ("line", "words"),
    [(["--draws", "0"], "above 0"), (["--draws", "100001"], "1 to 100000"), (["--seed", "-1"], "0 or more")],
)
def test_senseless_numbers(folder, line, words, capsys):
    assert main(["scatter", str(folder), *line, "-q"]) == 2
    assert words in capsys.readouterr().err


def test_a_bundle_without_a_plan_is_told_what_to_do(tmp_path, capsys):
    part = str(tmp_path / "part")
    assert main(["net", str(goal_path("bracket")), "-o", part, "-q"]) == 0
    assert main(["scatter", part, "-q"]) == 2
    assert "blossom plan" in capsys.readouterr().err
