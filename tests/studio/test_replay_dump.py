"""``blossom validate`` with checkpoints and black box, ``--from-step``, and ``blossom replay-dump``."""

import json
import shutil

import pytest

from models.goals import goal_path
from studio.cli import main
from studio.manifest import read_manifest
from twin.run_settings import RunSettings


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "part"
    assert main(["net", str(goal_path("bracket")), "-o", str(folder), "-q"]) == 0
    assert main(["plan", str(folder), "--no-diagnosis", "-q"]) == 0
    assert main(["validate", str(folder), "-q"]) == 0
    return folder


@pytest.fixture
def bundle(made, tmp_path, monkeypatch):
    shutil.copytree(made, tmp_path / "part")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "part"


def test_validate_leaves_side_table_and_checkpoints(bundle):
    files = read_manifest(bundle).files
    assert files["checkpoints.npz"]["stage"] == files["model.json"]["stage"] == "validate"
    assert "black-box.npz" not in files
    table = json.loads((bundle / "model.json").read_text())
    xml = (bundle / "model.xml").read_text()
    assert set(table["machine"]) == {"scene", "laser_head", "rotary", "frame"}
    names = [f["geom"] for f in table["faces"]] + [t["geom"] for t in table["tabs"]]
    for part in table["machine"].values():
        names += [*part["bodies"], *part["geoms"], *part["sites"]]
    assert table["tabs"] and "laser_lens" in names and "chuck_min" in names and "frame_x_min" in names
    assert all(f'name="{name}"' in xml for name in names)


def test_any_step_can_be_started_again(bundle, capsys):
    plan = json.loads((bundle / "plan.json").read_bytes())
    before = {path.name: path.read_bytes() for path in bundle.iterdir()}
    steps = range(0, len(plan["steps"]), max(1, len(plan["steps"]) // 4))
    for step in (*steps, len(plan["steps"]) - 1):
        assert main(["validate", "part", "--from-step", str(step), "--json"]) == 0
        values = json.loads(capsys.readouterr().out)
        assert values["same_state"] and values["finished"]
        assert values["after_step"] < max(step, 1)
    assert main(["validate", "part", "--from-step", "3", "-q"]) == 0
    assert "bit for bit" in capsys.readouterr().out
    assert before == {path.name: path.read_bytes() for path in bundle.iterdir()}


@pytest.mark.parametrize(
    ("step", "said"), [("9999", "the plan has steps 0 to"), ("-1", "-1"), ("x", "from-step")]
)
def test_an_unknown_step_is_told(bundle, capsys, step, said):
    assert main(["validate", "part", "--from-step", step, "-q"]) == 2
    assert said in capsys.readouterr().err


def test_a_bundle_that_was_never_validated_is_told(bundle, capsys):
    assert main(["plan", "part", "--no-diagnosis", "-q"]) == 0
    assert not (bundle / "checkpoints.npz").exists()
    assert main(["validate", "part", "--from-step", "1", "-q"]) == 2
    assert "blossom validate" in capsys.readouterr().err


def test_a_failed_simulation_leaves_a_black_box_that_opens(bundle, capsys, monkeypatch):
    with monkeypatch.context() as change:
        change.setattr("twin.dynamics.RunSettings", lambda: RunSettings(largest_rate_rad_s=0.05))
        assert main(["validate", "part", "--json"]) == 1
    values = json.loads(capsys.readouterr().out)
    assert values["verdict"] == "numerical"
    assert "replay-dump" in values["reason"]
    assert "black-box.npz" in read_manifest(bundle).files
    arguments = ["replay-dump", "part", "--picture", "failed.png", "--states", "failed.csv"]
    assert main(arguments) == 0
    text = capsys.readouterr().out
    assert "the simulation failed" in text and "rad/s" in text and "bit for bit" in text
    assert (bundle.parent / "failed.png").read_bytes().startswith(b"\x89PNG")
    rows = (bundle.parent / "failed.csv").read_text().splitlines()
    assert main(["replay-dump", "part/black-box.npz", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["same_bits"] is True
    assert len(rows) == 1 + told["states"] * told["hinges"]
    assert main(["validate", "part", "-q"]) == 0
    assert not (bundle / "black-box.npz").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["part"], "leaves one only where the simulation failed"),
        (["nothing"], "no such file"),
        (["part/plan.json"], "damaged, or no file of states"),
        (["part/checkpoints.npz"], "expected 'metal-blossom/black-box'"),
    ],
)
def test_what_is_no_dump_is_refused_in_words(bundle, capsys, arguments, said):
    assert main(["replay-dump", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_a_state_that_is_not_there_is_told(bundle, capsys, monkeypatch):
    with monkeypatch.context() as change:
        change.setattr("twin.dynamics.RunSettings", lambda: RunSettings(largest_rate_rad_s=0.05))
        main(["validate", "part", "-q"])
    capsys.readouterr()
    assert main(["replay-dump", "part", "--picture", "x.png", "--at", "99"]) == 2
    assert "holds states 0 to" in capsys.readouterr().err
    assert main(["replay-dump", "part", "--picture", "x.svg"]) == 2
    assert "ends in .png" in capsys.readouterr().err
    assert not (bundle.parent / "x.png").exists()
