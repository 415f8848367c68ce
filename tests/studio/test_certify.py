"""``--certify`` and ``blossom certify``: the proof is written, read back, and forgotten with its plan."""

import json

import pytest

from models.goals import goal_path
from studio.cli import main
from studio.manifest import read_manifest


@pytest.fixture
def bundle(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["net", str(goal_path("bracket")), "-o", "part", "-q"]) == 0
    return tmp_path / "part"


def test_a_plan_is_proven_and_proven_again(bundle, capsys):
    assert main(["plan", "part", "--certify", "--json"]) == 0
    values = json.loads(capsys.readouterr().out.splitlines()[-1])
    kept = json.loads((bundle / "contact.json").read_bytes())
    assert kept["proven"]
    sight = json.loads((bundle / "sight.json").read_bytes())
    assert sight["proven"]
    assert values["contact"] == f"{kept['summary']}; {sight['summary']}"
    manifest = read_manifest(bundle)
    assert kept["plan_sha256"] == manifest.sha256_of("plan.json")
    assert kept["net_sha256"] == manifest.sha256_of("net.fold")
    before = {path.name: path.read_bytes() for path in bundle.iterdir()}
    assert main(["certify", "part", "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["proven"]
    assert again["matches_file"]
    assert again["sight_proven"]
    assert again["free"] == again["turns"] == kept["turns"]
    assert before == {path.name: path.read_bytes() for path in bundle.iterdir()}
    assert main(["plan", "part", "-q"]) == 0
    assert not (bundle / "contact.json").exists()
    assert not (bundle / "sight.json").exists()
    assert main(["certify", "part", "-q"]) == 0
    assert "turns certified free" in capsys.readouterr().out


def test_a_bundle_without_a_plan_is_told_what_to_do(bundle, capsys):
    assert main(["certify", "part", "-q"]) == 2
    assert "blossom plan" in capsys.readouterr().err
