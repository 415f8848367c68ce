"""``blossom compare`` and ``blossom guide`` on bundles of a bracket."""

from __future__ import annotations

import json
import os
import re
import shutil

import pytest

from models.goals import goal_path
from planner.fold_plan import Clip, Cut, Fold, Release, Rotate
from studio.cli import main
from studio.guide_files import BROWSERS, PrintError, _browser
from studio.guide_pictures import stretches
from studio.report_steps import StepSetting
from tests.studio.small_plan import small_plan

os.environ.setdefault("MUJOCO_GL", "egl")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two bundles: one whole, one other seed and thickness without a job."""
    where = tmp_path_factory.mktemp("pair")
    whole, other = str(where / "whole"), str(where / "other")
    assert main(["net", str(goal_path("bracket")), "-o", whole, "-q"]) == 0
    assert main(["net", str(goal_path("bracket")), "-o", other, "--thickness", "0.12", "-q"]) == 0
    for line in (["plan", whole, "-q"], ["validate", whole, "-q"], ["job", whole, "-q"]):
        assert main(line) == 0
    assert main(["plan", other, "-q", "--seed", "3", "--tilt", "0"]) == 0
    return where


def test_a_bundle_equals_itself(folder, capsys):
    assert main(["compare", str(folder / "whole"), str(folder / "whole")]) == 0
    assert capsys.readouterr().out == "every file of the two bundles is the same\n"


def test_what_went_in_and_what_came_out_is_told(folder, capsys):
    line = ["compare", str(folder / "whole"), str(folder / "other")]
    assert main([*line, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    inputs = {d["name"]: (d["first"], d["second"]) for d in found["inputs"]}
    assert inputs["thickness"] == ("0.1 mm", "0.12 mm")
    assert inputs["plan tilt deg"] == ("-", "0")
    assert found["same_goal"]
    figures = {d["name"]: d for d in found["figures"]}
    assert figures["passes"]["better"] == 1  # thicker metal bends less
    assert int(figures["passes"]["first"]) < int(figures["passes"]["second"])
    assert figures["verdict"] == {"name": "verdict", "first": "pass", "second": "not validated", "better": 0}
    assert "job.json" in found["files"]
    assert main(line) == 0
    assert re.search(r"^passes +\d+\* +\d+$", capsys.readouterr().out, re.MULTILINE)


def test_a_folder_that_is_no_bundle(folder, tmp_path, capsys):
    assert main(["compare", str(folder / "whole"), str(tmp_path)]) == 2
    assert "no complete bundle" in capsys.readouterr().err


def test_the_guide_is_one_page_that_needs_nothing(folder, capsys):
    assert main(["guide", str(folder / "whole"), "-q"]) == 0
    page = (folder / "whole-guide.html").read_text("utf-8")
    assert "The simulation of this very job passed" in page
    assert "not calibrated" in page
    assert not re.search(r'(?:src|href)="(?!data:)', page)
    assert page.count("data:image/png;base64,") == page.count("<img ") >= 3
    assert page.count('<svg class="setup"') == 2
    for words in ("blossom resume", "--dry-run", "--frame", "--arm", "Emergency stop"):
        assert words in page
    first = (folder / "whole-guide.html").read_bytes()
    capsys.readouterr()
    assert main(["guide", str(folder / "whole"), "--json", "-o", str(folder / "again.html")]) == 0
    assert json.loads(capsys.readouterr().out)["bytes"] == len(first)
    assert (folder / "again.html").read_bytes() == first


@pytest.mark.skipif(not any(map(shutil.which, BROWSERS)), reason="no browser that prints is installed")
def test_a_pdf_is_printed(folder):
    file = folder / "guide.pdf"
    assert main(["guide", str(folder / "whole"), "-q", "-o", str(file)]) == 0
    data = file.read_bytes()
    assert data.startswith(b"%PDF-") and data.rstrip().endswith(b"%%EOF")


def test_no_browser_is_told(monkeypatch):
    monkeypatch.setattr("shutil.which", lambda _name: None)
    with pytest.raises(PrintError, match=r"write FILE\.html"):
        _browser()


def test_wrong_endings_and_missing_jobs_are_told(folder, capsys):
    assert main(["guide", str(folder / "whole"), "-o", "guide.docx"]) == 2
    assert ".html or .pdf" in capsys.readouterr().err
    assert main(["guide", str(folder / "other"), "-q"]) == 2
    assert "blossom job" in capsys.readouterr().err
    assert not (folder / "other-guide.html").exists()


@pytest.mark.parametrize("most", [3, 4, 8])
def test_stretches_hold_every_step_once(most):
    plan = small_plan()
    settings = {
        n: StepSetting(10, 5.0, 100.0, 2.0, 1.0) for n, s in enumerate(plan.steps) if isinstance(s, Fold)
    }
    found = stretches(plan, settings, most)
    assert len(found) <= most
    assert [s.first for s in found] == [0, *(s.last + 1 for s in found[:-1])]
    assert found[-1].last == len(plan.steps) - 1
    assert found[-1].released and not any(s.released for s in found[:-1])
    assert not found[0].creases
    count = {
        kind: sum(isinstance(s, kind) for s in plan.steps) for kind in (Cut, Clip, Fold, Rotate, Release)
    }
    assert sum(s.cuts for s in found) == count[Cut]
    assert sum(s.passes for s in found) == 10 * count[Fold]
    assert {c for s in found for c in s.creases} == {s.crease for s in plan.steps if isinstance(s, Fold)}
