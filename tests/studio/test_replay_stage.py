"""What a person reads when a replay cannot start, or does not come to its end."""

from __future__ import annotations

import io

import pytest

from studio import pipeline
from studio.errors import UsageError
from studio.manifest import MANIFEST_NAME, Manifest
from studio.progress import Progress
from studio.replay_stage import machine_of
from studio.workspace import Workspace


@pytest.mark.parametrize("port", ["emulater", "Emulator", "EMULATOR", "emulated"])
def test_a_misspelt_emulator_gets_the_right_name(tmp_path, port):
    with (
        pytest.raises(UsageError, match="did you mean emulator"),
        machine_of(Workspace(tmp_path, Manifest()), port),
    ):
        pytest.fail("must not come here")


@pytest.mark.parametrize("port", ["/dev/ttyUSB0", "COM3", "socket://emulator:3333"])
def test_other_ports_are_passed_on(tmp_path, port):
    with machine_of(Workspace(tmp_path, Manifest()), port) as url:
        assert url == port


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError])
def test_a_replay_that_ends_early_names_its_journal(tmp_path, monkeypatch, error):
    (tmp_path / MANIFEST_NAME).write_bytes(Manifest().to_bytes())
    (tmp_path / "journal-001.jsonl").write_text("")
    shown = io.StringIO()

    def fail(ws, _port, _mode, **_named):
        ws.path("journal-002.jsonl").write_text("")
        raise error

    monkeypatch.setattr(pipeline, "replay_stage", fail)
    with pytest.raises(error):
        pipeline.replay_bundle(tmp_path, "emulator", "arm", yes=False, progress=Progress(stream=shown))
    assert shown.getvalue() == f"the journal tells how far it came: {tmp_path / 'journal-002.jsonl'}\n"
