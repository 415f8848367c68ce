"""``blossom check`` on good and bad meshes: one message each, never a traceback."""

from __future__ import annotations

import json
import shutil

import pytest

from models.goals import goal_names, goal_path
from studio.cli import main


@pytest.mark.parametrize("name", goal_names())
def test_the_shipped_goals_can_be_used(name, capsys):
    assert main(["check", str(goal_path(name))]) == 0
    text = capsys.readouterr().out
    assert text.splitlines()[0] == f"{name}.obj can be used."
    assert main(["check", str(goal_path(name)), "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["longest_side_mm"] == pytest.approx(60.0, abs=0.01)


def test_every_bad_input_gets_one_message(shared_meshes, tmp_path, capsys):
    cases = json.loads((shared_meshes / "bad" / "expected.json").read_text())["cases"]
    wrong = []
    for number, case in enumerate(cases):
        path = shared_meshes / case["file"]
        if "as" in case:
            renamed = tmp_path / str(number) / case["as"]
            renamed.parent.mkdir()
            shutil.copy(path, renamed)
            path = renamed
        code = main(["check", str(path)])
        out, err = capsys.readouterr()
        expected = {"reject": (2,), "accept": (0,), "repair_or_reject": (0, 2)}[case["expect"]]
        ok = code in expected and "Traceback" not in err and "internal error" not in err
        if code == 2:
            ok = ok and err.startswith("error: ") and err.count("\n") == 1 and path.name in err
        if code == 0 and case["expect"] == "repair_or_reject":
            ok = ok and "note: " in out
        if not ok:
            wrong.append((case["file"], case["expect"], code, err.strip() or out.strip()))
    assert wrong == []
