"""The journal of a replay: what the machine really did, one JSON record a line, chained by hashes."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from rigs.errors import JobError, MachineError

__all__ = ["Journal", "JournalWriter", "Outcome", "read_journal"]

Outcome = Literal["complete", "stopped", "fault", "unfinished"]


@dataclass(frozen=True)
class Journal:
    """A journal that was read back.

    Attributes:
        path: of the file.
        header: what was replayed, where and how.
        done: indices of the blocks that the machine confirmed, in order (head and tail left out).
        in_doubt: the block whose light may or may not have burnt, or None.
        outcome: how it ended; ``unfinished`` when the last record is missing.
        reason: why it stopped, in words.
        torn: True when the last line is incomplete, as after a crash.
        records: all records.
    """

    path: Path
    header: dict[str, Any]
    done: tuple[int, ...]
    in_doubt: int | None
    outcome: Outcome
    reason: str
    torn: bool
    records: tuple[dict[str, Any], ...]

    @property
    def emulated(self) -> bool:
        """True when no real machine was involved."""
        return bool(self.header.get("emulated"))


class JournalWriter:
    """Appends records; a record that promises light is on the disk before the light.

    Attributes:
        path: of the file.
        durable: True to fsync promises; an emulated machine and a dry run need none.
    """

    def __init__(self, path: Path, *, durable: bool) -> None:
        self.path = path
        self.durable = durable
        self._hash = ""
        self._count = 0
        try:
            self._fd: int | None = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        except FileExistsError as error:
            raise JobError(f"{path}: this journal exists already: a replay never writes over one") from error
        except OSError as error:
            raise JobError(f"{path}: cannot write the journal: {error.strerror}; no byte was sent") from error

    def write(self, kind: str, *, sync: bool = False, **fields: Any) -> None:  # noqa: ANN401  JSON values
        """Append a record; with ``sync`` it is on the disk when this returns.

        Raises:
            MachineError: if it cannot be written: then no light may follow.
        """
        if self._fd is None:
            raise MachineError(f"{self.path}: the journal is closed")
        body = json.dumps({"n": self._count, "kind": kind, **fields}, separators=(",", ":"), allow_nan=False)
        self._hash = hashlib.sha256((self._hash + body).encode()).hexdigest()
        line = f'{body[:-1]},"hash":"{self._hash}"}}\n'.encode()
        try:
            if os.write(self._fd, line) != len(line):
                raise OSError("disk full")
            if sync and self.durable:
                os.fsync(self._fd)
        except OSError as error:
            raise MachineError(
                f"{self.path}: the journal cannot be written ({error}): stopped before light"
            ) from error
        self._count += 1

    def close(self) -> None:
        """Flush to the disk and close; a disk that fails now changes nothing: every promise was synced."""
        if self._fd is not None:
            fd, self._fd = self._fd, None
            with contextlib.suppress(OSError):
                if self.durable:
                    os.fsync(fd)
            with contextlib.suppress(OSError):
                os.close(fd)


def read_journal(path: Path) -> Journal:
    """Read a journal and check its hash chain; a torn last line is normal and left out.

    Raises:
        JobError: if it cannot be read, is no journal, or was edited.
    """
    try:
        lines = path.read_bytes().split(b"\n")
    except OSError as error:
        raise JobError(f"{path}: cannot read the journal: {error.strerror}") from error
    torn = lines[-1] != b""
    records: list[dict[str, Any]] = []
    chain = ""
    for number, line in enumerate(lines[:-1], 1):
        body, _, tail = line.rpartition(b',"hash":"')
        chain = hashlib.sha256(chain.encode() + body + b"}").hexdigest()
        if tail != chain.encode() + b'"}':
            raise JobError(
                f"{path}, line {number}: the hash chain breaks here: the journal was edited or damaged"
            )
        records.append(json.loads(line))
    if not records or records[0].get("kind") != "header":
        raise JobError(f"{path}: not a replay journal (no header record)")
    return _summary(path, records, torn)


def _summary(path: Path, records: list[dict[str, Any]], torn: bool) -> Journal:
    done: list[int] = []
    doubt: int | None = None
    for record in records:
        if record["kind"] == "intent":
            doubt = record["block"]
        elif record["kind"] == "done":
            done += [record["block"]] if record["block"] >= 0 else []
            doubt = None if doubt == record["block"] else doubt
    last = records[-1]
    ended = last["kind"] == "end"
    return Journal(
        path, records[0], tuple(done), doubt, last["outcome"] if ended else "unfinished",
        last.get("reason", "") if ended else "the last record is missing", torn, tuple(records),
    )  # fmt: skip
