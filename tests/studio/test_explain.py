"""``blossom explain``: the story of creases that stay short, from the bundle or worked out on the spot."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from planner.diagnosis import Cure, Diagnosis, Proof, View
from planner.goal_mesh import GoalMesh
from studio.cli import main
from studio.diagnosis_words import blocked_summary, story
from studio.manifest import read_manifest
from tests.studio.small_plan import small_plan

OBJ = """v 0 0 0
v 20 0 0
v 20 12 0
v 0 12 0
v 35 0 {z}
v 35 12 {z}
f 1 2 3
f 1 3 4
f 2 5 6
f 2 6 3
"""


def steep_obj(angle_deg: float) -> str:
    """Two squares at a sharp angle."""
    x, z = 20.0 + 15.0 * np.cos(np.radians(angle_deg)), 15.0 * np.sin(np.radians(angle_deg))
    lines = OBJ.format(z=z).splitlines()
    return "\n".join(line.replace("v 35", f"v {x}") for line in lines) + "\n"


@pytest.fixture
def steep(tmp_path, monkeypatch):
    """A bundle with a plan whose only crease wants 150 degrees."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "steep.obj").write_text(steep_obj(150.0))
    assert main(["net", "steep.obj", "-o", "out", "-q"]) == 0
    return tmp_path / "out"


def explained(capsys, *words):
    capsys.readouterr()
    assert main(["explain", "out", *words, "-q"]) == 0
    return capsys.readouterr().out


def test_the_story_of_a_fold_that_is_too_steep(steep, capsys):
    assert main(["plan", "out", "--tilt", "30", "-q"]) == 0
    text = explained(capsys)
    assert "its own face" in text
    assert "impossible as a crease" in text
    assert "120.5°" in text
    assert "tilt by up to 60° (now 30°): 100 % folded, 0.00 mm rms, all creases fold" in text.replace(
        "100.0", "100"
    )
    (blocked,) = json.loads((steep / "plan.json").read_bytes())["blocked"]
    assert blocked["diagnosis"]["impossible"]["kind"] == "angle"
    assert main(["report", "out", "-q"]) == 0
    page = (steep / "report.html").read_text(encoding="utf-8")
    assert "would fold with this change: tilt by up to 60°" in page


def test_a_plan_without_diagnosis_is_looked_into_and_left_alone(steep, capsys):
    assert main(["plan", "out", "--tilt", "30", "-q", "--no-diagnosis"]) == 0
    before = {p.name: p.read_bytes() for p in steep.iterdir()}
    assert "diagnosis" not in json.loads(before["plan.json"])["blocked"][0]
    values = json.loads(explained(capsys, "--json"))
    (crease,) = values["blocked"]
    assert crease["diagnosis"]["cause"] == "own flap"
    assert crease["diagnosis"]["cures"][0]["kind"] == "tilt"
    assert crease["story"][0].startswith(f"crease {crease['crease']}: folded to")
    one = explained(capsys, str(crease["crease"]), "--deep")
    assert "tried, does not free it" in one
    assert {p.name: p.read_bytes() for p in steep.iterdir()} == before
    assert read_manifest(steep).parameters["plan"]["diagnosis"] is False


def test_nothing_blocked_and_no_such_crease(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.obj").write_text(steep_obj(40.0))
    assert main(["net", "roof.obj", "-o", "out", "-q"]) == 0
    assert main(["plan", "out", "-q"]) == 0
    crease = json.loads((tmp_path / "out" / "plan.json").read_bytes())["steps"]
    number = next(step["crease"] for step in crease if step["op"] == "fold")
    assert explained(capsys) == "every crease folds all the way\n"
    assert explained(capsys, str(number)) == f"crease {number} folds all the way\n"
    assert main(["explain", "out", "99", "-q"]) == 2
    assert "edge 99 is not a crease of the net" in capsys.readouterr().err


CURES = (
    (Cure("tilt", np.radians(50.0)), "tilt by up to 50°"),
    (Cure("axis", np.radians(20.0)), "turn the rotary axis by 20°"),
    (Cure("base", face=3), "(--base 3)"),
    (Cure("cut", crease=2, join=(1, 4)), "cut crease 2 and join faces 1 and 4 instead"),
    (Cure("clearance", 0.2), "set the faces in by 0.2 mm"),
    (Cure("hidden", 0.25), "let 25 % of a crease be hidden"),
    (Cure("unfold", np.radians(5.0), crease=0), "fold crease 0 by 5° less"),
    (Cure("restore"), "fold it all the way"),
)


def with_diagnosis(found: Diagnosis):
    plan = small_plan()
    return replace(plan, blocked=(replace(plan.blocked[0], diagnosis=found),))


@pytest.mark.parametrize(("cure", "words"), CURES, ids=lambda x: x.kind if isinstance(x, Cure) else "")
def test_every_cure_has_words(cure, words):
    cure = replace(cure, frees=True, completion=0.97, shape_rms=1.5, blocked=1)
    plan = with_diagnosis(Diagnosis("contact", -1.3, 4, 2, cures=(cure,), tries=4))
    text = "\n".join(story(plan, plan.blocked[0]))
    assert words in text
    assert "97.0 % folded, 1.50 mm rms, 1 short" in text
    assert words in blocked_summary(plan, plan.blocked[0])["cure"]


@pytest.mark.parametrize("cause", ["sight", "own flap", "contact", "substrate", "order", "room"])
@pytest.mark.parametrize(
    "proof", [None, Proof("angle", 2.0), Proof("axis", 1.8), Proof("orders", 0.0, 12, 25)]
)
def test_every_cause_and_proof_has_words(cause, proof):
    views = (View(0.0, -0.5, 0.3, 4), View(0.3, -1.0, 0.2, 5))
    found = Diagnosis(cause, -1.0, 4, 2, True, views, (2, 0, 4), (1, 3), 2.0, proof, (), 0, capped=True)
    plan = with_diagnosis(found)
    lines = story(plan, plan.blocked[0])
    assert any("proof: impossible" in line for line in lines) == (proof is not None)
    assert any("face 2 - crease 1 - face 0 - crease 3 - face 4" in line for line in lines)
    assert "not looked for yet" in lines[-1]
    assert blocked_summary(plan, plan.blocked[0])["cure"] == ""


def test_the_steep_shape_is_what_it_says():
    rows = [line.split()[1:] for line in steep_obj(150.0).splitlines()]
    goal = GoalMesh(np.array(rows[:6], float), np.array(rows[6:], int) - 1)
    normals = goal.face_normals
    assert np.degrees(np.arccos(normals[0] @ normals[2])) == pytest.approx(150.0)
