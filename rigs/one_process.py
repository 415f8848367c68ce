"""One process at a time: a lock on a file that ends with the process, whatever happens to it."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from rigs.errors import JobError

__all__ = ["one_at_a_time"]


@contextlib.contextmanager
def one_at_a_time(path: Path) -> Iterator[None]:
    """Hold a lock on an existing file while the block runs; the file itself is left alone.

    Raises:
        JobError: if another process holds it.
    """
    if sys.platform == "win32":  # the exclusive port is what is left there
        yield
        return
    import fcntl

    descriptor = os.open(path, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise JobError(
                f"{path.parent}: another process replays this bundle just now: wait until it has ended"
            ) from error
        yield
    finally:
        os.close(descriptor)
