"""Files that are either whole or not there: written beside their place, then renamed into it."""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path

__all__ = ["write_atomic"]


def write_atomic(path: str | os.PathLike[str], data: bytes | str) -> None:
    """Write ``data`` (text as UTF-8, newlines as given) to ``path``, whole or not at all.

    The bytes go to a hidden file in the same folder, reach the disk, and take the name in one step, so
    that an interrupted run never leaves half a file. An existing file keeps its permissions.

    Args:
        path: the file to write; its folder must exist.
        data: the content.

    Raises:
        OSError: if the folder is missing or cannot be written, or the disk is full; ``path`` is then as
            it was.
    """
    target = Path(path)
    if target.is_dir():
        raise IsADirectoryError(f"{target} is a folder; name a file")
    content = data.encode("utf-8") if isinstance(data, str) else data
    beside = target.with_name(f".{target.name[:100]}.{secrets.token_hex(6)}.part")
    try:
        with beside.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if target.exists():
            beside.chmod(target.stat().st_mode & 0o7777)
        beside.replace(target)
    finally:
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)
