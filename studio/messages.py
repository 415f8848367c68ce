"""Errors in words: what the ``blossom`` command prints instead of a traceback."""

from __future__ import annotations

import errno

from studio.exit_codes import BAD_INPUT, INTERNAL, INTERRUPTED, MACHINE, NO, exit_code_of

__all__ = ["error_text"]

_LEADS = {
    NO: "no",
    BAD_INPUT: "error",
    MACHINE: "machine",
    INTERRUPTED: "stopped",
    INTERNAL: "internal error",
}


def error_text(error: BaseException) -> str:
    """One message for people: a leading word that tells the kind, then what was wrong and what to do."""
    code = exit_code_of(error)
    lead = _LEADS[code]
    if code == INTERRUPTED:
        return "stopped: interrupted; nothing half-written was left behind"
    if code == INTERNAL:
        return (
            f"{lead}: {type(error).__name__}: {_one_line(error) or 'no further words'}. This is a mistake in "
            "Metal Blossom, please report it with the input; --debug shows where it happened"
        )
    if isinstance(error, MemoryError):
        return f"{lead}: not enough memory; try a smaller face budget with --faces N"
    if isinstance(error, OSError) and type(error).__module__ == "builtins":
        return f"{lead}: {_os_error(error)}"
    faces = getattr(error, "faces", ())
    text = str(error).strip() or type(error).__name__
    if faces and "face" not in text:
        shown = ", ".join(map(str, faces[:8])) + (" …" if len(faces) > 8 else "")
        text += f" (faces {shown})"
    return f"{lead}: {text}"


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())


def _os_error(error: OSError) -> str:
    where = f"{error.filename}: " if error.filename else ""
    cures = {
        errno.ENOENT: "no such file; check the path",
        errno.EISDIR: "is a folder, expected a file",
        errno.ENOTDIR: "a part of this path is a file, expected a folder",
        errno.EACCES: "no permission; choose another place or change the permission",
        errno.EROFS: "the file system is read-only; choose another place",
        errno.ENOSPC: "no space left on the device; free some and run again",
        errno.ENAMETOOLONG: "the name is too long; choose a shorter one",
    }
    return where + cures.get(error.errno or 0, error.strerror or str(error))
