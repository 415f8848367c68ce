"""Probing sends questions only and names every difference."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rigs.emulator import start_emulator
from rigs.probe import probe
from rigs.rig import load_rig, rig_names
from tests.rigs.replay_jobs import RIG


@pytest.mark.parametrize("name", rig_names())
def test_an_emulated_rig_agrees_with_its_profile(name: str) -> None:
    rig = load_rig(name)
    with start_emulator(name) as machine:
        found = probe(machine.url, rig)
    assert found.mistakes == ()
    assert found.identity.emulated
    assert found.status.state == ("Alarm" if rig.controller.homing == "required" else "Idle")


def test_every_difference_is_named_and_only_questions_are_sent(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    with start_emulator(settings={32: 0, 100: 79, 120: 1}, trace=trace) as machine:
        found = probe(machine.url, RIG)
    assert [text.split(" of the controller is ")[0] for text in found.mistakes] == [
        "setting $32", "setting $100", "setting $120",
    ]  # fmt: skip
    lines = [r["text"] for r in map(json.loads, trace.read_text().splitlines()) if r["kind"] == "line"]
    assert lines == ["$I", "$$", "$#", "$G"]


def test_another_firmware_is_named() -> None:
    with start_emulator("grbl-diode-swap") as machine:
        found = probe(machine.url, RIG)
    assert any("has 3 axes, grbl-4axis needs 4 (X Y Z A)" in text for text in found.mistakes)
