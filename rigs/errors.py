"""Errors of the rigs: one root, each with a built-in mix-in."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

__all__ = ["JobError", "MachineError", "ProfileError", "RigError", "UnknownNameError"]


class RigError(Exception):
    """Root of every error that the rigs package raises."""


class ProfileError(RigError, ValueError):
    """A rig or material profile is wrong: the message names file, place and cure (exit code 2)."""


class UnknownNameError(RigError, LookupError):
    """No shipped profile has this name; the message lists the nearest ones (exit code 2).

    Attributes:
        kind: what kind of thing was asked for, such as ``rig``.
        name: what was asked for.
        choices: the names that exist.
    """

    def __init__(self, kind: str, name: str, choices: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.choices = tuple(sorted(choices))
        near = difflib.get_close_matches(name, self.choices, n=3, cutoff=0.4)
        hint = f"did you mean {' or '.join(near)}? " if near else ""
        super().__init__(
            f"unknown {kind} '{name}': {hint}choose one of {', '.join(self.choices)}, "
            "or give the path of a .toml file"
        )

    def __reduce__(self) -> tuple[type[UnknownNameError], tuple[str, str, tuple[str, ...]]]:
        return UnknownNameError, (self.kind, self.name, self.choices)


class JobError(RigError, ValueError):
    """A job cannot run on this rig, or its files do not belong together (exit code 1)."""


class MachineError(RigError, OSError):
    """The machine refused, failed or vanished (exit code 3).

    Attributes:
        block: index of the block that was being sent, or None.
        step: index of the plan step of that block, -1 where it belongs to none, or None.
    """

    def __init__(self, message: str, *, block: int | None = None, step: int | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.block = block
        self.step = step

    def __str__(self) -> str:
        where = [f"block {self.block}"] if self.block is not None else []
        where += [f"step {self.step}"] if self.step is not None and self.step >= 0 else []
        return f"{self.message} ({', '.join(where)})" if where else self.message
