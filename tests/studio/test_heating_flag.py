"""``--heating section``: the choice is kept in the bundle, and later stages make the same process."""

import json

import pytest

from models.goals import goal_path
from studio.cli import main
from studio.manifest import read_manifest


@pytest.fixture
def bundle(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert main(["net", str(goal_path("bracket")), "-o", "part", "-q"]) == 0
    return tmp_path / "part"


def test_the_section_is_used_from_plan_to_certificate(bundle, tmp_path, capsys):
    assert main(["plan", "part", "-q"]) == 0
    fast = read_manifest(bundle).process
    assert fast["heating"] == "fast"
    assert not (tmp_path / "cache" / "metal-blossom" / "section-tables").exists()
    assert main(["plan", "part", "--heating", "section", "-q"]) == 0
    section = read_manifest(bundle).process
    assert section["heating"] == "section"
    assert section["sha256"] != fast["sha256"]
    tables = sorted((tmp_path / "cache" / "metal-blossom" / "section-tables").iterdir())
    assert tables
    for table in tables:  # made anew or read from disk: the same process
        table.unlink()
    assert main(["validate", "part", "-q"]) == 0
    certificate = json.loads((bundle / "validation.json").read_bytes())
    assert certificate["heating"]["model"] == "section-table/1"
    assert main(["plan", "part", "--heating", "section", "-q"]) == 0
    assert read_manifest(bundle).process == section
    capsys.readouterr()
    assert main(["plan", "part", "--heating", "slow", "-q"]) == 2
    assert "slow" in capsys.readouterr().err
