"""A file is written whole or not at all."""

from __future__ import annotations

import os
import stat

import pytest

from planner.atomic_file import write_atomic


def test_bytes_and_text_arrive_unchanged(tmp_path):
    write_atomic(tmp_path / "a.bin", b"\x00\r\n\xff")
    write_atomic(str(tmp_path / "blüte 花.txt"), "Maß\n°C\r\n")
    assert (tmp_path / "a.bin").read_bytes() == b"\x00\r\n\xff"
    assert (tmp_path / "blüte 花.txt").read_bytes() == "Maß\n°C\r\n".encode()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.bin", "blüte 花.txt"]


def test_an_existing_file_is_replaced_and_keeps_its_permissions(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(0o640)
    write_atomic(path, "new")
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_a_failing_write_leaves_the_old_file_and_nothing_beside_it(tmp_path, monkeypatch):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_atomic(path, "new")
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_missing_folders_and_folders_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError):
        write_atomic(tmp_path / "none" / "a.txt", "x")
    with pytest.raises(IsADirectoryError, match="is a folder"):
        write_atomic(tmp_path, "x")
    assert list(tmp_path.iterdir()) == []
