"""``blossom net``: the first stage, and what it refuses."""

from __future__ import annotations

import json

import numpy as np
import pytest

from models.goals import goal_path
from planner.fold_file import read_fold
from planner.goal_file import read_goal_ply
from studio.cli import main
from studio.manifest import file_sha256, read_manifest


@pytest.fixture(autouse=True)
def desk(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "box.obj").write_bytes(goal_path("bracket").read_bytes())


def net(*words):
    return main(["net", "box.obj", "-q", *words])


def test_a_net_is_a_bundle_of_its_own(tmp_path, capsys):
    assert net("--base", "1", "--seed", "5", "--json") == 0
    values = json.loads(capsys.readouterr().out)
    folder = tmp_path / "box"
    goal = read_goal_ply(folder / "goal.ply")
    flat = read_fold(folder / "net.fold", goal)
    assert flat.base_face == 1
    assert values["faces"] == len(goal.faces) == len(flat.faces)
    assert values["creases"] == int(np.isin(flat.assignment, ["V", "M"]).sum())
    manifest = read_manifest(folder)
    assert manifest.seed == 5
    assert manifest.parameters["net"]["base"] == 1
    assert manifest.input == {"name": "box.obj", "sha256": file_sha256(tmp_path / "box.obj")}
    assert {p.name for p in folder.iterdir()} == {*manifest.files, "manifest.json", "timing.json"}


def test_same_input_and_seed_same_bytes(tmp_path):
    assert net("-o", "one") == net("-o", "two") == 0
    for path in (tmp_path / "one").iterdir():
        if path.name != "timing.json":
            assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes(), path.name


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("--base", "999"), "--base 999"),
        (("--method", "steepst"), "did you mean steepest"),
        (("--rig", "gbrl-4axis"), "grbl-4axis"),
        (("--material", "340"), "304"),
        (("--thickness", "40"), "40 mm sheet"),
    ],
)
def test_refusals_leave_nothing_behind(words, part, tmp_path, capsys):
    assert net(*words) == 2
    err = capsys.readouterr().err
    assert part in err
    assert err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["box.obj"]


def test_a_bundle_is_not_overwritten(capsys):
    assert net() == 0
    assert net() == 2
    assert "--force" in capsys.readouterr().err
    assert net("--force") == 0


def test_a_profile_of_ones_own_travels_with_the_bundle(tmp_path):
    from importlib import resources

    text = (resources.files("rigs") / "profiles" / "grbl-4axis.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(
        text.replace('name = "grbl-4axis"', 'name = "mine"'), encoding="utf-8"
    )
    assert net("--rig", "mine.toml") == 0
    (tmp_path / "mine.toml").unlink()
    assert read_manifest(tmp_path / "box").rig["name"] == "mine"
    assert 'name = "mine"' in (tmp_path / "box" / "rig.toml").read_text(encoding="utf-8")


def test_prove_says_what_is_proven(capsys):
    assert net("--prove") == 0
    assert "proven: no" in capsys.readouterr().out


def test_a_changed_net_is_named(tmp_path, capsys):
    assert net() == 0
    with (tmp_path / "box" / "net.fold").open("a") as stream:
        stream.write("\n")
    assert main(["plan", "box", "-q"]) == 2
    assert "net.fold (changed)" in capsys.readouterr().err
