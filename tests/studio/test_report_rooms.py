"""Margins, sight and temperatures in the report are those of the proofs and of the process."""

from __future__ import annotations

import json

import numpy as np
import pytest

from planner.contact_certificate import certify_contact
from planner.fold_plan import Fold
from planner.sight_certificate import certify_sight
from studio.bundle_check import open_manifest
from studio.bundle_summary import step_settings
from studio.report_heat import AGES_S, cooling_c
from studio.report_rooms import step_rooms
from studio.report_steps import StepRoom, steps_html
from studio.workspace import Workspace
from twin.cooling import AMBIENT_C


@pytest.fixture(scope="module")
def ws(tmp_path_factory):
    from models.goals import goal_path
    from studio.cli import main

    folder = tmp_path_factory.mktemp("rooms") / "flower"
    assert main(["net", str(goal_path("flower")), "-o", str(folder), "--method", "steepest", "-q"]) == 0
    assert main(["plan", str(folder), "-q"]) == 0
    return Workspace(folder, open_manifest(folder))


def test_margins_and_sight_are_looked_at_where_nothing_was_proven(ws):
    rooms = step_rooms(ws)
    assert sorted(rooms) == [i for i, step in enumerate(ws.plan.steps) if isinstance(step, Fold)]
    proof, whole = certify_contact(ws.plan), certify_sight(ws.plan)
    assert {turn.step: turn.margin_mm for turn in proof.turns} == {i: r.margin_mm for i, r in rooms.items()}
    for turn in whole.turns:
        assert not rooms[turn.step].seen_proven
        # the proof bounds the whole turn, the look only its ends
        assert rooms[turn.step].seen >= 1.0 - turn.hidden - 1e-12


def test_proofs_of_the_bundle_are_read(ws):
    for name, values in (
        ("contact.json", {"told_up_to": 0.25, "steps": [{"step": 4, "margin": 0.125}]}),
        ("sight.json", {"steps": [{"step": 4, "hidden": 0.03}]}),
    ):
        ws.path(name).write_text(json.dumps(values))
        ws.record("plan", name)
    try:
        assert step_rooms(ws) == {4: StepRoom(0.125, 0.25, 0.97, True)}
    finally:
        for name in ("contact.json", "sight.json"):
            ws.manifest.files.pop(name)


def test_a_crease_cools_from_its_passes_to_the_room(ws):
    for fold in ws.process.folds[:5]:
        celsius = np.array(cooling_c(fold, ws.process, ws.material))
        assert len(celsius) == len(AGES_S)
        assert (np.diff(celsius) <= 0.0).all()
        assert celsius[0] <= fold.peak_top_c
        assert AMBIENT_C <= celsius[-1] < AMBIENT_C + 5.0


def test_every_fold_has_its_setting(ws):
    settings = step_settings(ws)
    for fold in ws.process.folds:
        assert settings[fold.step].passes == fold.passes
        assert settings[fold.step].start_c == (fold.start_c[0], fold.start_c[-1])
        assert len(settings[fold.step].after_c) == len(AGES_S)


@pytest.mark.parametrize(
    ("room", "margin", "sight"),
    [(StepRoom(0.25, 0.25, 1.0, True), "&gt; 0.25", "100"), (StepRoom(0.0304, 1.0, 0.97), "0.030", "97*"),
     (StepRoom(None, 1.0, 0.9999, True), "", "99.9"), (StepRoom(), "", "")],
)  # fmt: skip
def test_room_in_the_table(room, margin, sight):
    table = steps_html([{"op": "fold", "text": "fold", "to": -12.34}], {}, {0: room})
    cells = table.partition("<tbody>")[2].split("<td class=num>")[2:]
    assert [cell.partition("</td>")[0] for cell in cells] == ["-12.3°", "", "", "", "", margin, sight, ""]
