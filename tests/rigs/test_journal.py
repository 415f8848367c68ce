"""The journal: chained, torn tails are normal, edits are found."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs.errors import JobError, MachineError
from rigs.journal import JournalWriter, read_journal


def write(path: Path, blocks: int = 3, end: bool = True) -> bytes:
    with contextlib.closing(JournalWriter(path, durable=True)) as journal:
        journal.write("header", emulated=True)
        for block in range(blocks):
            journal.write("intent", sync=True, block=block)
            journal.write("done", block=block)
        if end:
            journal.write("end", outcome="complete", reason="")
    return path.read_bytes()


def test_round_trip(tmp_path: Path) -> None:
    write(tmp_path / "j")
    journal = read_journal(tmp_path / "j")
    assert journal.done == (0, 1, 2)
    assert journal.in_doubt is None
    assert (journal.outcome, journal.torn, journal.emulated) == ("complete", False, True)
    assert [r["n"] for r in journal.records] == list(range(8))


@given(st.data())
def test_a_torn_tail_loses_that_record_only(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("j") / "j"
    content = write(path)
    first = content.index(b"\n") + 1
    cut = data.draw(st.integers(first, len(content)))
    path.write_bytes(content[:cut])
    journal = read_journal(path)
    whole = content[:cut].count(b"\n")
    assert len(journal.records) == whole
    assert journal.torn == (not content[:cut].endswith(b"\n"))
    intents = [r["block"] for r in journal.records if r["kind"] == "intent"]
    assert set(intents) - set(journal.done) == ({journal.in_doubt} if journal.in_doubt is not None else set())


@given(st.data())
def test_any_edit_is_found(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    path = tmp_path_factory.mktemp("j") / "j"
    content = write(path)
    place = data.draw(st.integers(0, len(content) - 2))
    byte = data.draw(st.integers(32, 126))
    if content[place] in (byte, ord("\n")):
        return
    path.write_bytes(content[:place] + bytes([byte]) + content[place + 1 :])
    with pytest.raises(JobError, match="hash chain breaks"):
        read_journal(path)


def test_left_out_and_swapped_records_are_found(tmp_path: Path) -> None:
    lines = write(tmp_path / "j").splitlines(keepends=True)
    for changed in (lines[:2] + lines[3:], [lines[0], lines[2], lines[1], *lines[3:]], lines[1:]):
        (tmp_path / "j").write_bytes(b"".join(changed))
        with pytest.raises(JobError, match="line"):
            read_journal(tmp_path / "j")


def test_intent_without_done_is_in_doubt(tmp_path: Path) -> None:
    with contextlib.closing(JournalWriter(tmp_path / "j", durable=False)) as journal:
        journal.write("header")
        journal.write("intent", block=7)
    back = read_journal(tmp_path / "j")
    assert (back.in_doubt, back.outcome) == (7, "unfinished")


def test_bad_files_and_full_disks(tmp_path: Path) -> None:
    with pytest.raises(JobError, match="cannot read the journal"):
        read_journal(tmp_path / "none")
    (tmp_path / "empty").write_bytes(b"")
    with pytest.raises(JobError, match="no header"):
        read_journal(tmp_path / "empty")
    (tmp_path / "other").write_text(json.dumps({"kind": "x"}) + "\n")
    with pytest.raises(JobError, match="line 1"):
        read_journal(tmp_path / "other")
    with pytest.raises(JobError, match="cannot write the journal"):
        JournalWriter(tmp_path / "no" / "folder", durable=True)
    closed = JournalWriter(tmp_path / "closed", durable=False)
    closed.close()
    with pytest.raises(MachineError, match="closed"):
        closed.write("intent")


def test_disk_full_stops_before_light(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    journal = JournalWriter(tmp_path / "j", durable=True)
    journal.write("header")

    def full(fd: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("rigs.journal.os.fsync", full)
    with pytest.raises(MachineError, match="stopped before light"):
        journal.write("intent", sync=True, block=0)
