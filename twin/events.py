"""What a simulation saw that should not be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["Event", "EventKind"]

EventKind = Literal["contact", "occluded", "stall", "tunnel", "sag", "numerical", "rule"]


@dataclass(frozen=True)
class Event:
    """One finding of the sweep or of the dynamic run.

    Attributes:
        kind: what kind of verdict it leads to.
        step: plan step during which it was seen.
        crease: net edge that was turning, -1 if substrate was bent.
        faces: faces of the net that take part, the moving one first.
        substrate: substrate triangles that take part.
        depth_mm: depth of penetration (0 where that says nothing).
        force_n: contact force in N (0 where it was not computed).
        angle_rad: angle of the turning crease.
        time_s: simulated time, -1 for the kinematic sweep.
        detail: a sentence for people.
        rule: name of the rule that is broken, "" for other kinds.
    """

    kind: EventKind
    step: int
    crease: int
    faces: tuple[int, ...] = ()
    substrate: tuple[int, ...] = ()
    depth_mm: float = 0.0
    force_n: float = 0.0
    angle_rad: float = 0.0
    time_s: float = -1.0
    detail: str = ""
    rule: str = ""

    @property
    def pair(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """What touches what, apart from order and depth."""
        return tuple(sorted(self.faces)), self.substrate
