"""Errors of the studio: one root, each with a built-in mix-in."""

from __future__ import annotations

__all__ = ["BundleError", "OutputError", "StudioError", "UsageError"]


class StudioError(Exception):
    """Root of every error that the studio raises."""


class BundleError(StudioError, ValueError):
    """A bundle is incomplete, was changed, or lacks what a stage needs (exit code 2)."""


class OutputError(StudioError, OSError):
    """The output folder cannot be written, or something is there already (exit code 2)."""


class UsageError(StudioError, ValueError):
    """Flags that do not go together or make no sense (exit code 2)."""
