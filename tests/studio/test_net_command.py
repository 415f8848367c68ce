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
from tests.planner.no_net_shapes import overlapping_fan, write_obj


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


def test_methods_are_those_of_the_planner():
    from planner.net_methods import NET_METHODS
    from studio.options import METHODS

    assert sorted(METHODS) == sorted(NET_METHODS)


@pytest.mark.parametrize("words", [("--prove",), ("--prove", "20"), ("--prove=20",)])
def test_prove_says_what_is_proven(words, tmp_path, capsys):
    assert net(*words) == 0
    assert "proven (" in capsys.readouterr().out
    certificate = json.loads((tmp_path / "box" / "net.fold").read_text())["blossom:certificate"]
    assert certificate["optimal"] is True
    assert read_manifest(tmp_path / "box").parameters["net"]["prove_s"] in (20.0, 30.0)


def test_a_proof_is_checked_afresh(tmp_path, capsys):
    assert net("--prove") == 0
    capsys.readouterr()
    assert main(["net", "--verify", "box/net.fold"]) == 0
    assert "verdict      holds" in capsys.readouterr().out
    assert main(["net", "box.obj", "--verify", "box/net.fold", "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["format"] == "metal-blossom/net-check"
    assert values["holds"] is values["optimal"] is True
    assert values["problems"] == []


def test_a_false_certificate_is_a_no(tmp_path, capsys):
    assert net("--prove") == 0
    file = tmp_path / "box" / "net.fold"
    data = json.loads(file.read_text())
    data["blossom:certificate"]["edits"] += 1
    file.write_text(json.dumps(data))
    capsys.readouterr()
    assert main(["net", "--verify", str(file)]) == 1
    out = capsys.readouterr().out
    assert "verdict      does not hold" in out
    assert "problem: the certificate says" in out


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("--verify", "nowhere.fold"), "no such file"),
        (("--verify", "box"), "box/net.fold"),
        (("--verify", "box.obj"), "no goal.ply beside it"),
        (("box.obj", "--verify", "box.obj"), "not a FOLD file"),
        (("--verify", "box/net.fold", "--prove"), "leave --prove away"),
        (("--verify", "box/net.fold", "-o", "x"), "leave --output away"),
        (("other.obj", "--verify", "box/net.fold"), "another goal mesh"),
        ((), "a mesh is missing"),
    ],
)
def test_what_cannot_be_checked_is_bad_input(words, part, tmp_path, capsys):
    assert net() == 0
    (tmp_path / "other.obj").write_bytes(goal_path("star").read_bytes())
    before = sorted(tmp_path.rglob("*"))
    capsys.readouterr()
    assert main(["net", *words]) == 2
    err = capsys.readouterr().err
    assert part in err
    assert err.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    "words", [("--prove", "0"), ("--prove", "nan"), ("--mesh-edit", "-1"), ("--mesh-edit", "wide")]
)
def test_flags_that_make_no_sense(words, tmp_path, capsys):
    assert net(*words) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["box.obj"]


@pytest.fixture
def fan(tmp_path):
    """An open fan of triangles that is one flat pattern only, and overlaps itself by 6 degrees."""
    write_obj(overlapping_fan(366.0), tmp_path / "fan.obj")
    return tmp_path / "fan"


def test_without_a_net_nothing_is_written(fan, tmp_path, capsys):
    assert main(["net", "fan.obj", "-q"]) == 1
    err = capsys.readouterr().err
    assert "faces overlap (0 on 11)" in err
    assert err.index("--mesh-edit") < err.index("--leave-out")
    assert not fan.exists()


def test_a_changed_mesh_is_the_goal_of_the_bundle(fan, tmp_path, capsys):
    assert main(["net", "fan.obj", "-q", "--mesh-edit", "3", "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["faces_left_out"] == 0
    assert any("changed the mesh on request" in notice for notice in values["notices"])
    goal = read_goal_ply(fan / "goal.ply")
    edit = read_manifest(fan).goal["edit"]
    assert edit["goal_sha256"] == goal.sha256 != edit["goal_sha256_before"]
    assert 0.0 < edit["deviation_mm"] <= 3.0
    before = overlapping_fan(366.0)
    moved = np.linalg.norm(goal.vertices - before.vertices, axis=1)
    assert moved.max() == pytest.approx(edit["deviation_mm"], abs=1e-5)
    assert read_fold(fan / "net.fold", goal).certificate.faces_left_out == 0


def test_a_change_that_is_too_small_is_a_no(fan, capsys):
    assert main(["net", "fan.obj", "-q", "--mesh-edit", "0.01"]) == 1
    assert "changes of the mesh within 0.01 mm gave a net" in capsys.readouterr().err
    assert not fan.exists()


def test_missing_faces_are_named_everywhere(fan, capsys):
    assert main(["net", "fan.obj", "-q", "--leave-out", "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    data = json.loads((fan / "net.fold").read_text())
    goal = read_goal_ply(fan / "goal.ply")
    missing = sorted(set(range(12)) - set(data["blossom:faces_goal"]))
    assert len(goal.faces) == 12
    assert len(missing) == 1
    assert values["faces_left_out"] == data["blossom:certificate"]["faces_left_out"] == 1
    assert any(
        "left out on request" in n and f"face {missing[0]} of goal.ply" in n for n in values["notices"]
    )
    assert main(["net", "--verify", str(fan / "net.fold")]) == 0


def test_a_mesh_with_a_net_is_left_alone(tmp_path):
    assert net("-o", "one") == net("-o", "two", "--mesh-edit", "5", "--leave-out") == 0
    for name in ("goal.ply", "net.fold"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_a_changed_net_is_named(tmp_path, capsys):
    assert net() == 0
    with (tmp_path / "box" / "net.fold").open("a") as stream:
        stream.write("\n")
    assert main(["plan", "box", "-q"]) == 2
    assert "net.fold (changed)" in capsys.readouterr().err
