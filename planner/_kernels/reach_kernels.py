"""How far one crease turns in sight under the rotary angle that shows it farthest, fine tilts among them."""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.beam_kernels import OVERHANG_RAD, aim, lean, tilt_for_lean
from planner._kernels.compiled import inner
from planner._kernels.sight_kernels import hidden_share, hides_alone, sight_limit

LEAST_GAIN_RAD = math.radians(0.2)
"""A further tilt is not chosen, and a further stage of a turn not made, for less."""

WITNESSES = 4
"""Solids that hid a crease under the last tilts that are remembered while tilts are tried."""


@inner
def farthest_view(  # type: ignore[no-untyped-def]
    face, parent, moving_mask, panel, flat, solids, centres, radii, suspects,
    hinge, length, sign, now, free, first, fine, grazes, ex, ey, head, hidden_max, substeps, aimed,
    intervals, turned,
):  # fmt: skip
    """The tilt under which a crease is seen farthest of those that are tried.

    Args:
        face, parent: the crease.
        moving_mask ... suspects: as in ``hidden_share``.
        hinge: (4,) start and unit direction of the crease, and its ``length``.
        sign: +1 for a valley, -1 for a mountain.
        now: |angle| of the crease.
        free: how far it may turn on.
        first: rotary angle that is tried first.
        fine: (L,) tilts that are tried.
        grazes: (G,) angles: tilts are tried as well along the face as it stands so much before the end of the
            turn. A slit that closes is lit longest along the closing face.
        ex, ey, head, hidden_max, substeps: as in ``fold_greedily``.
        aimed, intervals, turned: work space.

    Returns:
        (reach from now on, rotary angle, True if that is not ``first``, what hides the crease then, -1 if
        nothing but the face itself)
    """
    ox, oy, ux, uy = hinge[0], hinge[1], hinge[2], hinge[3]
    mx, my = ox + 0.5 * length * ux, oy + 0.5 * length * uy
    upright = 0.0 if sign > 0.0 else math.pi
    most_tilt = 0.0
    for tilt in fine:
        most_tilt = max(most_tilt, abs(tilt))
    reach, view, tilted, who = 0.0, first, False, np.int64(-1)
    count, witnesses = 0, np.empty(WITNESSES, np.int64)  # they are looked at first under the next tilt
    for k in range(-1, len(fine) + len(grazes)):
        if k < 0:
            beam = first
        elif k < len(fine):
            beam = upright + fine[k]
        else:
            end = now + free - grazes[k - len(fine)]
            if end <= 0.0:
                continue
            tilt = tilt_for_lean(end, upright, ex, ey, head, mx, my, ux, uy, sign, aimed)
            if abs(tilt) > most_tilt:
                continue
            beam = upright + tilt
        aim(beam, ex, ey, head, aimed)
        own = lean(aimed, mx, my, ux, uy, sign) + OVERHANG_RAD - now
        allowed = max(0.0, min(free, own))
        if k >= 0:
            # only a tilt that shows the crease further than now is worth the whole sweep
            ahead = reach + LEAST_GAIN_RAD
            if allowed <= ahead:
                continue
            blocked = False
            for j in range(min(count, WITNESSES)):
                blocked = blocked or hides_alone(
                    witnesses[j], moving_mask[witnesses[j]], solids, ox, oy, ux, uy, length, sign, ahead, aimed,
                    hidden_max, intervals, turned,
                )  # fmt: skip
            if blocked:
                continue
            share, most, _ = hidden_share(
                panel[face], panel[parent], panel, moving_mask, flat, solids, centres, radii,
                suspects, ox, oy, ux, uy, length, sign, ahead, aimed, intervals, turned,
            )  # fmt: skip
            if share > hidden_max:
                witnesses[count % WITNESSES], count = most, count + 1
                continue
        seen, by = sight_limit(
            panel[face], panel[parent], panel, moving_mask, flat, solids, centres, radii, suspects,
            ox, oy, ux, uy, length, sign, allowed, aimed, hidden_max, intervals, turned,
            substeps, True,
        )  # fmt: skip
        if by >= 0:
            witnesses[count % WITNESSES], count = by, count + 1
        if k < 0:
            who = by
        if seen > reach + LEAST_GAIN_RAD:
            reach, view, tilted, who = seen, beam, k >= 0, by
    return reach, view, tilted, who


@inner
def never_seen(target, hinges, lengths, beams, out):  # type: ignore[no-untyped-def]
    """Angle that each crease misses in any order, since no tilt lets the beam in between its two faces at the end.

    Args:
        target: (n,) wanted signed angles.
        hinges: (n, 4) start and unit direction of the creases.
        lengths: (n,) of the creases.
        beams: (K, BEAM_SIZE) the beams to choose from, the largest tilts among them; the first half lights the
            top side.
        out: (n,) the result, rad.
    """
    half = len(beams) // 2
    for f in range(len(target)):
        out[f] = 0.0
        if target[f] == 0.0:
            continue
        sign = 1.0 if target[f] > 0.0 else -1.0
        ux, uy = hinges[f, 2], hinges[f, 3]
        mx, my = hinges[f, 0] + 0.5 * lengths[f] * ux, hinges[f, 1] + 0.5 * lengths[f] * uy
        most = 0.0
        for r in range(len(beams)):
            if (r < half) == (sign > 0.0):
                most = max(most, lean(beams[r], mx, my, ux, uy, sign))
        out[f] = max(0.0, abs(target[f]) - most - OVERHANG_RAD)
