"""``blossom plan --planner``: planners to compare with make whole bundles, the others say why not."""

from __future__ import annotations

import json

import pytest

from models.goals import goal_path
from planner.motion_baselines import FOLD_METHODS, PLANNING_METHODS
from studio.cli import main
from studio.stages import PLANNERS


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planners") / "bracket"
    assert main(["net", str(goal_path("bracket")), "-o", str(folder), "--quiet"]) == 0
    return folder


def test_planners_of_the_command_are_those_that_make_plans():
    assert set(PLANNERS) == set(PLANNING_METHODS) - {"fp-search"}


@pytest.mark.parametrize("planner", ["mp", "first-block"])
def test_other_planners_write_plans_that_validate(bundle, planner, capsys):
    assert main(["plan", str(bundle), "--planner", planner, "--budget", "0.5", "--json"]) == 0
    capsys.readouterr()
    plan = json.loads((bundle / "plan.json").read_text())
    assert plan["metrics"]["fold_completion"] == pytest.approx(1.0)
    manifest = json.loads((bundle / "manifest.json").read_text())
    assert manifest["parameters"]["plan"]["planner"] == planner
    assert main(["validate", str(bundle), "--quiet"]) == 0


@pytest.mark.parametrize("planner", sorted(set(FOLD_METHODS) - set(PLANNING_METHODS)))
def test_motions_of_many_creases_are_no_plans(bundle, planner, capsys):
    assert main(["plan", str(bundle), "--planner", planner]) == 2
    told = capsys.readouterr().err
    assert "no laser can do" in told
    assert "blossom bench paper" in told


def test_an_unknown_planner_is_refused(bundle, capsys):
    assert main(["plan", str(bundle), "--planner", "first-blok"]) == 2
    assert "did you mean first-block?" in capsys.readouterr().err
