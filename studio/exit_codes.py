"""Exit codes of the ``blossom`` command and which error leads to which."""

from __future__ import annotations

__all__ = ["BAD_INPUT", "DONE", "INTERNAL", "INTERRUPTED", "MACHINE", "NO", "exit_code_of"]

DONE = 0
"""The work is done and the verdict, where there is one, is ``pass``."""

NO = 1
"""The verdict is no: no net, no plan, a validation that does not pass, a job that cannot be made."""

BAD_INPUT = 2
"""Bad input or usage: the user has to change something."""

MACHINE = 3
"""The machine refused, vanished or raised an alarm."""

INTERNAL = 70
"""A mistake in Metal Blossom itself (``EX_SOFTWARE`` of BSD's sysexits)."""

INTERRUPTED = 130
"""Stopped by Ctrl-C (128 + SIGINT)."""

_CODES: dict[str, int] = {
    "MachineError": MACHINE,
    "NetError": NO,
    "PlanError": NO,
    "JobError": NO,
    "SimulationError": NO,
    "SettingError": BAD_INPUT,
    "HeatingError": NO,
    "PlannerError": BAD_INPUT,
    "RigError": BAD_INPUT,
    "TwinError": BAD_INPUT,
    "StudioError": BAD_INPUT,
    "PermissionError": BAD_INPUT,
    "FileNotFoundError": BAD_INPUT,
    "IsADirectoryError": BAD_INPUT,
    "NotADirectoryError": BAD_INPUT,
    "OSError": BAD_INPUT,
    "MemoryError": BAD_INPUT,
}
"""Exit code by class name; the first class of the error's ancestry that is listed decides."""


def exit_code_of(error: BaseException) -> int:
    """Exit code for an error that reached the command line.

    The classes are looked up by name, so that no package has to be imported to ask.
    """
    if isinstance(error, KeyboardInterrupt):
        return INTERRUPTED
    for kind in type(error).__mro__:
        if kind.__name__ in _CODES:
            return _CODES[kind.__name__]
    return INTERNAL
