"""Why a crease stays short of its goal, and what would free it: the values that ``diagnose`` gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["Cause", "Cure", "CureKind", "Diagnosis", "Proof", "View"]

Cause = Literal["sight", "own flap", "contact", "substrate", "order", "room"]
"""What stops a crease.

``sight``: something stands between it and the beam. ``own flap``: the turning face leans so far over its
crease that the beam would have to come from beyond the largest tilt. ``contact``: the moving part would touch
the net. ``substrate``: it would touch sheet that has to stay. ``order``: nothing stops it where it stands, a
planner that comes back to it could fold it. ``room``: it is held back so that others go further.
"""

CureKind = Literal["tilt", "axis", "base", "cut", "clearance", "hidden", "unfold", "restore"]


@dataclass(frozen=True)
class View:
    """How a crease is seen under one rotary angle, at the moment at which it is stopped.

    Attributes:
        rotary_rad: the rotary angle.
        to_rad: signed angle of the crease up to which it is seen well enough; where it stands already if it
            is hidden from the start.
        hidden: share of the crease that is hidden just beyond.
        by: face that hides most of it, -1 if none; the face itself where it leans over its crease.
    """

    rotary_rad: float
    to_rad: float
    hidden: float
    by: int


@dataclass(frozen=True)
class Proof:
    """That a crease cannot fold fully, and within what.

    Attributes:
        kind: ``angle``: the wanted angle is beyond the steepest lean that any beam within the tilt limit
            sees, whatever base, order and axis. ``axis``: the same for the direction that the rotary
            axis has in this sheet. ``orders``: all outside-in orders of this net were tried.
        bound_rad: largest angle that is possible (``angle``, ``axis``), else 0.
        states: states of the part that were looked at (``orders``), else 0.
        beams: rotary angles that were tried in each (``orders``), else 0.
    """

    kind: Literal["angle", "axis", "orders"]
    bound_rad: float = 0.0
    states: int = 0
    beams: int = 0


@dataclass(frozen=True)
class Cure:
    """A change that was tried, and what came of it when the net was folded again on its sheet, all rules on.

    Attributes:
        kind: what was changed: the tilt limit, the direction of the rotary axis, the base face, one crease of
            the net, the clearance, the share of a crease that may be hidden, the angle of another crease, or
            that the crease itself is no longer held back (``restore``).
        value: the new tilt limit in rad, how far the rotary axis is turned in the sheet in rad, the clearance
            in mm, the share, or by how much the other crease is folded less, in rad; else 0.
        face: the new base face; -1 for other kinds.
        crease: the crease (net edge) that is cut, or folded less; -1 for other kinds.
        join: the two faces that are joined in place of the cut crease; empty for other kinds.
        frees: the crease folds fully then (or, if it was the one cut, the joint in its place does).
        reached_rad: angle that it reaches then.
        completion: fold completion of the whole then.
        shape_rms: shape error of the whole then, mm.
        blocked: number of creases that stay short then.
        tries: changes of this kind that were folded for this crease.
    """

    kind: CureKind
    value: float = 0.0
    face: int = -1
    crease: int = -1
    join: tuple[int, ...] = ()
    frees: bool = False
    reached_rad: float = 0.0
    completion: float = 0.0
    shape_rms: float = 0.0
    blocked: int = 0
    tries: int = 1


@dataclass(frozen=True)
class Diagnosis:
    """Why one crease stays short, and what would free it.

    Attributes:
        cause: what stops it.
        at_rad: signed angle at which it is stopped.
        blocker: net face that hides or touches (for ``substrate``: the triangle); -1 if none.
        toucher: net face of the moving part that would touch; -1 unless something is touched.
        carried: the blocker hangs on this crease and turns with it.
        views: how it is seen straight and under the best tilt there is, the best one last; empty if sight is
            not asked for.
        path_faces: faces of the net on the way from one end of the witness to the other.
        path_creases: creases between them, one fewer.
        loss_mm: what is missing of the angle times the lever arm of what hangs on it (rms over the part).
        proof: that it cannot fold fully, if that is proven; None means "not found", not "impossible".
        cures: what was tried, the most useful first.
        tries: nets folded for this crease alone.
        capped: some of what could be tried was not, to save time.
    """

    cause: Cause
    at_rad: float
    blocker: int = -1
    toucher: int = -1
    carried: bool = False
    views: tuple[View, ...] = ()
    path_faces: tuple[int, ...] = ()
    path_creases: tuple[int, ...] = ()
    loss_mm: float = 0.0
    proof: Proof | None = None
    cures: tuple[Cure, ...] = ()
    tries: int = 0
    capped: bool = False
