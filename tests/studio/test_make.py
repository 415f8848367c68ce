"""The main job end to end on a small shape: make, the stages one by one, replay, and refusals."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys

import pytest

from models.goals import goal_path
from studio.cli import main
from studio.manifest import read_manifest

FORMAT_FILES = {
    "goal.ply", "net.fold", "sheet.svg", "sheet.dxf", "plan.json", "model.xml", "model.json",
    "validation.json", "checkpoints.npz", "job.gcode", "job.json",
    "report.html", "motion.glb", "manifest.json",
}  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a mesh and the bundle that make wrote of it."""
    folder = tmp_path_factory.mktemp("made")
    shutil.copy(goal_path("bracket"), folder / "part.obj")
    assert main(["make", str(folder / "part.obj"), "-o", str(folder / "part"), "-q", "--seed", "3"]) == 0
    return folder


def files(folder):
    return {
        p.name: p.read_bytes() for p in folder.iterdir() if not p.name.startswith(("timing.json", "journal-"))
    }


def test_the_bundle_has_every_file_of_the_format(made):
    present = {p.name for p in (made / "part").iterdir()}
    assert present >= FORMAT_FILES
    assert present - FORMAT_FILES == {"rig.toml", "material.toml", "timing.json", "journal-001.jsonl"}
    manifest = read_manifest(made / "part")
    assert set(manifest.files) == (FORMAT_FILES | {"rig.toml", "material.toml"}) - {"manifest.json"}
    assert manifest.process["sha256"]


def test_hashes_bind_the_files_to_each_other(made):
    manifest = read_manifest(made / "part")
    plan = json.loads((made / "part" / "plan.json").read_text())
    certificate = json.loads((made / "part" / "validation.json").read_text())
    assert plan["goal_sha256"] == manifest.sha256_of("goal.ply")
    assert plan["net_sha256"] == manifest.sha256_of("net.fold")
    assert certificate["plan_sha256"] == manifest.sha256_of("plan.json")
    assert certificate["model_sha256"]
    for document in (plan, certificate):
        assert document["rig_sha256"] == manifest.rig["sha256"]
        assert document["material_sha256"] == manifest.material["sha256"]
    assert manifest.sha256_of("plan.json") in (made / "part" / "job.json").read_text()
    assert certificate["verdict"] == "pass"
    assert certificate["versions"] == manifest.versions and certificate["versions"]["numpy"]
    assert certificate["process"] == "uncalibrated" and certificate["heating"]["calibration"] == "none"
    assert certificate["heating"]["grade"] == "C" and certificate["heating"]["flags"]


def test_same_input_and_seed_same_bytes_and_stages_equal_make(made, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copy(made / "part.obj", tmp_path / "part.obj")
    for line in (
        "net part.obj --seed 3", "plan part", "validate part", "job part", "report part",
        "replay part --port emulator --dry-run",
    ):  # fmt: skip
        assert main([*line.split(), "-q"]) == 0, line
    one, other = files(made / "part"), files(tmp_path / "part")
    assert set(one) == set(other)
    assert [name for name in sorted(one) if one[name] != other[name]] == []
    assert "dry-run on EMULATED: complete" in capsys.readouterr().out


def test_the_summary_as_json(made, tmp_path, capsys):
    assert main(["report", str(made / "part"), "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    metrics = json.loads((made / "part" / "plan.json").read_text())["metrics"]
    assert values["completion"] == metrics["fold_completion"]
    assert values["verdict"] == "pass"
    assert values["passes"] > 0
    assert len(values["blocked"]) == len(json.loads((made / "part" / "plan.json").read_text())["blocked"])


def test_the_referee_finds_nothing(made, shared_meshes):
    referee = shared_meshes.parent / "check" / "check_bundle.py"
    if not referee.is_file():
        pytest.skip("the independent check is not there")
    done = subprocess.run(
        [sys.executable, str(referee), str(made / "part")], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]


@pytest.mark.parametrize("name", sorted(FORMAT_FILES - {"manifest.json"}))
def test_a_changed_file_is_named_by_every_later_stage(made, tmp_path, name, capsys):
    bundle = tmp_path / "part"
    shutil.copytree(made / "part", bundle)
    with (bundle / name).open("ab") as stream:
        stream.write(b" ")
    for line in ("plan", "validate", "job", "report", "replay --port emulator"):
        command, *rest = line.split()
        assert main([command, str(bundle), *rest, "-q"]) == 2
        assert f"{name} (changed)" in capsys.readouterr().err


def test_a_port_that_refuses(made, capsys):
    code = main(["replay", str(made / "part"), "--port", "socket://127.0.0.1:9", "-q"])
    assert code == 3
    err = capsys.readouterr().err
    assert err.startswith("machine: ")
    assert err.count("\n") == 1


def test_options_that_the_rig_cannot_do(made, tmp_path, capsys):
    bundle = tmp_path / "part"
    shutil.copytree(made / "part", bundle)
    assert main(["plan", str(bundle), "--tilt", "80", "-q"]) == 2
    assert "--tilt 80" in capsys.readouterr().err
    assert main(["plan", str(bundle), "--planner", "gp", "-q"]) == 2
    assert "did you mean mp" in capsys.readouterr().err
    for wrong in ("wide", "-1", "nan", "50"):
        assert main(["plan", str(bundle), f"--relief={wrong}", "-q"]) == 2
        assert f"--relief {wrong}: expected auto, off, or a radius" in capsys.readouterr().err
    assert files(bundle) == files(made / "part")


def test_bend_allowance_and_relief_as_wanted(made, tmp_path, capsys):
    """What the bundle says is what was asked for; without both, the drawing is the net's own."""
    wanted = {
        ("on", "auto"): (0.1, 0.1, 0.0333),
        ("off", "off"): (0.0, 0.0, 0.0),
        ("on", "0.2"): (0.2, 0.1, 0.0333),
    }
    drawings = set()
    for (allowance, relief), (hole, width, shift) in wanted.items():
        bundle = tmp_path / f"{allowance}-{relief}"
        shutil.copytree(made / "part", bundle)
        flags = ["--bend-allowance", allowance, "--relief", relief]
        assert main(["plan", str(bundle), *flags, "-q"]) == 0
        assert "bends        " in capsys.readouterr().out
        limits = json.loads((bundle / "plan.json").read_text())["blossom:limits"]
        assert limits["relief_mm"] == hole
        figures = read_manifest(bundle).process["pattern"]
        assert (figures["bend_width_mm"], figures["neutral_shift_mm"]) == (width, shift)
        assert (figures["largest_shift_mm"] > 0.0) == (allowance == "on")
        assert main(["job", str(bundle), "-q"]) == 0
        assert json.loads((bundle / "job.json").read_text())["pattern"] == figures
        capsys.readouterr()
        drawings.add((bundle / "sheet.svg").read_bytes())
    assert len(drawings) >= 2


def test_stages_say_what_is_missing(made, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copy(made / "part.obj", tmp_path / "part.obj")
    assert main(["net", "part.obj", "-q"]) == 0
    capsys.readouterr()
    for line in ("validate part", "job part", "report part", "replay part --port emulator"):
        assert main([*line.split(), "-q"]) == 2
        assert "blossom " in capsys.readouterr().err, line
