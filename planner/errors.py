"""Errors of the planner: one root, each with a built-in mix-in."""

from __future__ import annotations

__all__ = ["FormatError", "MeshError", "NetError", "PlanError", "PlannerError"]


class PlannerError(Exception):
    """Root of every error that the planner raises."""


class MeshError(PlannerError, ValueError):
    """The goal mesh cannot be used: the message names file, place and cure (exit code 2)."""


class FormatError(PlannerError, ValueError):
    """A file of a job does not follow its format, or does not belong to the job (exit code 2)."""


class NetError(PlannerError, ValueError):
    """No net exists or none was found: the goal is not formable from one sheet (exit code 1).

    Attributes:
        faces: goal faces that overlap in the best net found.
    """

    def __init__(self, message: str, faces: tuple[int, ...] = ()) -> None:
        super().__init__(message)
        self.faces = faces


class PlanError(PlannerError, ValueError):
    """No plan can be made under the given limits (exit code 1)."""
