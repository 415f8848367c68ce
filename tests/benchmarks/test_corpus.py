"""The corpus benchmark, driven with a command that stands in for blossom."""

from __future__ import annotations

import csv
import sys

import pytest

from benchmarks.corpus import main, mesh_kind
from models.goals import goal_path

# Passes creature_coarse with a bundle, refuses flower with a message, crashes on crown, hangs on antenna.
STAND_IN = """#!{python}
import json, pathlib, sys, time
mesh, folder = pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[4])
if mesh.stem == "antenna":
    time.sleep(60)
if mesh.stem == "flower":
    print(json.dumps({{"error": {{"message": "not formable\\n from one sheet"}}}}))
    sys.exit(1)
if mesh.stem == "crown":
    sys.exit(2)
folder.mkdir(parents=True)
(folder / "validation.json").write_text('{{"verdict": "pass"}}')
(folder / "net.fold").write_text('{{"blossom:certificate": {{"edits": 3}}}}')
(folder / "plan.json").write_text(
    '{{"metrics": {{"fold_completion": 0.96, "shape_rms": 0.125}}, "blocked": [{{}}], "steps": [{{}}, {{}}]}}'
)
"""

CHECKER = """import sys
print('{{"ok": {ok}, "failed_kinds": {kinds}}}')
sys.exit({code})
"""


@pytest.fixture
def stand_in(tmp_path):
    path = tmp_path / "stand-in"
    path.write_text(STAND_IN.format(python=sys.executable))
    path.chmod(0o755)
    return path


def run(tmp_path, stand_in, *options):
    folder = goal_path("creature_coarse").parent
    arguments = ["--meshes", str(folder), "--command", str(stand_in), "-o", str(tmp_path / "out"), *options]
    assert main(arguments) == 0
    with (tmp_path / "out" / "corpus.csv").open(newline="") as file:
        rows = {row["mesh"]: row for row in csv.DictReader(file)}
    return rows, (tmp_path / "out" / "corpus.md").read_text()


def test_each_way_to_end_has_its_line(tmp_path, stand_in):
    names = ["creature_coarse", "flower", "crown", "antenna"]
    rows, text = run(tmp_path, stand_in, "--limit", "5", "--only", *names)
    assert set(rows) == set(names)
    solid = rows["creature_coarse"]
    figures = (
        "kind",
        "faces",
        "exit_code",
        "verdict",
        "edits",
        "completion",
        "shape_rms_mm",
        "blocked",
        "steps",
    )
    assert [solid[key] for key in figures] == ["closed", "140", "0", "pass", "3", "0.96", "0.125", "1", "2"]
    assert (rows["flower"]["exit_code"], rows["flower"]["reason"]) == ("1", "not formable from one sheet")
    assert (rows["crown"]["exit_code"], rows["crown"]["reason"]) == ("2", "")
    assert (rows["antenna"]["exit_code"], rows["antenna"]["reason"]) == ("-1", "over the limit of 5 s")
    assert "closed: 1 of 1 fold to at least 95 % (100.0 %)" in text
    assert "closed: mean completion 96.00 % of 1 plans; 99.9 % folded and at most 0.5 mm off: 0 of 1" in text
    assert "open: no plan" in text
    assert "open: 0 of 3 fold to at least 95 % (0.0 %)" in text
    assert "ended without a reason: crown" in text


@pytest.mark.parametrize(
    ("ok", "kinds", "code", "found"),
    [("true", "{}", 0, "ok"), ("false", '{"collision": 2}', 1, "collision x2"), ("false", "3", 2, "exit 2")],
)
def test_what_the_checker_says_is_in_the_table(tmp_path, stand_in, ok, kinds, code, found):
    checker = tmp_path / "checker.py"
    checker.write_text(CHECKER.format(ok=ok, kinds=kinds, code=code))
    rows, text = run(tmp_path, stand_in, "--only", "creature_coarse", "--checker", str(checker))
    assert rows["creature_coarse"]["checker"].startswith(found)
    assert f"checker: {int(code == 0)} of 1 bundles without a finding" in text


def test_only_one_kind_each_run_on_its_own_processor(tmp_path, stand_in):
    names = ["creature_coarse", "crown"]
    rows, _ = run(tmp_path, stand_in, "--kind", "open", "--only", *names, "--processors", "1", "-j", "1")
    assert set(rows) == {"crown"}


def test_too_few_processors_are_said(tmp_path, stand_in, capsys):
    folder = goal_path("crown").parent
    arguments = ["--meshes", str(folder), "--command", str(stand_in), "-o", str(tmp_path / "out")]
    assert main([*arguments, "--processors", "100000"]) == 2
    assert "2 jobs of 100000 processors each need 200000" in capsys.readouterr().err


def test_bundles_are_kept_only_when_asked(tmp_path, stand_in):
    run(tmp_path, stand_in, "--only", "creature_coarse")
    assert not (tmp_path / "out" / "bundles").exists()
    run(tmp_path, stand_in, "--only", "creature_coarse", "--keep")
    assert (tmp_path / "out" / "bundles" / "creature_coarse" / "plan.json").is_file()


def test_nothing_to_run_is_said(tmp_path, capsys):
    assert main(["--meshes", str(tmp_path), "-o", str(tmp_path / "out")]) == 2
    assert "no mesh of at most 150 faces" in capsys.readouterr().err


def test_kind_and_faces_of_shapes():
    assert mesh_kind(goal_path("creature_coarse")) == ("closed", 140)
    assert mesh_kind(goal_path("crown")) == ("open", 30)
