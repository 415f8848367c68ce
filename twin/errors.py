"""Errors of the twin: one root, each with a built-in mix-in."""

from __future__ import annotations

__all__ = [
    "CalibrationError",
    "HeatingError",
    "ModelError",
    "RecordFileError",
    "SettingError",
    "SimulationError",
    "TwinError",
    "ValidationFileError",
]


class TwinError(Exception):
    """Root of every error that the twin raises."""


class ModelError(TwinError, ValueError):
    """No MuJoCo model can be made of the plan, or the model does not belong to it (exit code 2)."""


class SimulationError(TwinError, RuntimeError):
    """A simulation could not be run at all (a diverged run is a verdict, not an error)."""


class ValidationFileError(TwinError, ValueError):
    """A certificate does not follow its format (exit code 2)."""


class RecordFileError(TwinError, ValueError):
    """A black box or a file of checkpoints is damaged, or does not belong here (exit code 2)."""


class HeatingError(TwinError, ValueError):
    """Nothing that the rig can do folds this metal as wanted (exit code 1)."""


class SettingError(HeatingError):
    """A value of a laser setting is not finite or out of range (exit code 2)."""


class CalibrationError(TwinError, ValueError):
    """A table of burnt creases is wrong, or nothing can be fitted to it (exit code 2)."""
