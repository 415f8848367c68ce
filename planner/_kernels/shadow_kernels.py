"""What every face hides of every crease while it hangs on it, as bits: tilts of the rotary times angles of the turn.

What hangs on a crease stands, when the crease turns, as it will in the end: outside-in folding turns it last. So
what one face hides of one crease depends on these two and on the direction of the rotary axis only, not on the rest
of the net. It is worked out once for each goal; then a net is judged by looking up bits.
"""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.beam_kernels import BEAM_SIZE, KY, OVERHANG_RAD, aim, lean
from planner._kernels.compiled import entry, inner
from planner._kernels.cover_kernels import ABOVE_MM, END_SHARE, covered_interval

SAMPLES, PER_WORD, WORDS = 16, 4, 3
"""Angles of a turn; tilts in a 64-bit word, a bit for each angle; words. The first angle has the lowest bit."""


@inner
def in_crease_frame(corner, crease, sign, out):  # type: ignore[no-untyped-def]
    """Corners (3, 3) of a face along the crease, across it towards the flat child, and up to the light.

    ``crease`` (3, 3) is its start, its direction and the normal of the parent face.
    """
    ux, uy, uz = crease[1, 0], crease[1, 1], crease[1, 2]
    nx, ny, nz = crease[2, 0], crease[2, 1], crease[2, 2]
    vx, vy, vz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
    for k in range(3):
        x, y, z = corner[k, 0] - crease[0, 0], corner[k, 1] - crease[0, 1], corner[k, 2] - crease[0, 2]
        out[k, 0] = x * ux + y * uy + z * uz
        out[k, 1] = x * vx + y * vy + z * vz
        out[k, 2] = sign * (x * nx + y * ny + z * nz)


@inner
def _turn(tri, angle, out):  # type: ignore[no-untyped-def]
    """Corners (3, 3) in the frame of the crease, turned about it towards the light."""
    c, s = math.cos(angle), math.sin(angle)
    for k in range(3):
        out[k, 0] = tri[k, 0]
        out[k, 1], out[k, 2] = tri[k, 1] * c - tri[k, 2] * s, tri[k, 1] * s + tri[k, 2] * c


@inner
def _clear(tri, length, steep, wide):  # type: ignore[no-untyped-def]
    """True if the triangle hides nothing of the crease from any beam whose slope is at most ``steep``."""
    left, right, before, behind, top = True, True, True, True, 0.0
    for k in range(3):
        h = max(0.0, tri[k, 2])
        top = max(top, h)
        reach = steep * h + wide
        left = left and tri[k, 1] < -reach
        right = right and tri[k, 1] > reach
        before = before and tri[k, 0] < -reach
        behind = behind and tri[k, 0] > length + reach
    return top <= ABOVE_MM or left or right or before or behind


@entry
def hiding_pairs(corners, creases, lengths, angles, panels, fractions, steep, wide):  # type: ignore[no-untyped-def]
    """Which faces may hide something of which crease while they hang on it.

    Args:
        corners: (F, 3, 3) the goal, mm.
        creases: (D, 3, 3) see ``in_crease_frame``; two for an edge, for either face as the child.
        lengths, angles: (D,) length and signed goal angle of each; angle 0: never folded.
        panels: (F + D, 2) panel of every face in column 0; of child and parent of each crease behind.
        fractions: (SAMPLES,) of the goal angle, at which is looked.
        steep: largest slope of a beam.
        wide: largest radius of a beam over the goal.

    Returns:
        (rows (D, F), -1 where nothing is ever hidden; number of rows)
    """
    faces, count = len(corners), len(creases)
    rows = np.full((count, faces), -1, np.int32)
    used = 0
    tri, now = np.empty((3, 3)), np.empty((3, 3))
    for d in range(count):
        wanted = abs(angles[d])
        if wanted == 0.0:
            continue
        for x in range(faces):
            if panels[x, 0] == panels[faces + d, 0] or panels[x, 0] == panels[faces + d, 1]:
                continue
            in_crease_frame(corners[x], creases[d], 1.0 if angles[d] > 0.0 else -1.0, tri)
            for k in range(len(fractions)):
                _turn(tri, (fractions[k] - 1.0) * wanted, now)
                if not _clear(now, lengths[d], steep, wide):
                    rows[d, x] = used
                    used += 1
                    break
    return rows, used


@entry
def hidden_bits(  # type: ignore[no-untyped-def]
    corners, creases, lengths, angles, rows, fractions, tilts, headings, head, hidden_max, steep, wide,
    first, last, bits,
):  # fmt: skip
    """Set the bits of the rows of the creases from ``first`` to before ``last``.

    Args:
        corners, creases, lengths, angles, fractions, steep, wide: as in ``hiding_pairs``.
        rows: from there.
        tilts: (WORDS * PER_WORD,) rad.
        headings: (A,) directions of the rotary axis from the crease, rad.
        head: (8,) see ``beam_kernels``, parallel light.
        hidden_max: share of a crease that may be hidden.
        first, last: the creases.
        bits: (A, R + D, WORDS) set where the crease is hidden: by the face of a row; in the last D rows by the
            leaning child itself.
    """
    leaning = bits.shape[1] - len(creases)
    beams = np.zeros((len(headings), len(tilts), BEAM_SIZE))
    for a in range(len(headings)):
        for t in range(len(tilts)):
            aim(tilts[t], math.cos(headings[a]), math.sin(headings[a]), head, beams[a, t])
    tri, now = np.empty((3, 3)), np.empty((3, 3))
    one = np.uint64(1)
    for d in range(first, last):
        wanted = abs(angles[d])
        if wanted == 0.0:
            continue
        for a in range(len(headings)):
            for t in range(len(tilts)):
                most = lean(beams[a, t], 0.0, 0.0, 1.0, 0.0, 1.0) + OVERHANG_RAD
                for k in range(len(fractions)):
                    if fractions[k] * wanted > most:
                        bits[a, leaning + d, t // PER_WORD] |= one << np.uint64((t % PER_WORD) * SAMPLES + k)
        for x in range(len(corners)):
            row = rows[d, x]
            if row < 0:
                continue
            in_crease_frame(corners[x], creases[d], 1.0 if angles[d] > 0.0 else -1.0, tri)
            for k in range(len(fractions)):
                _turn(tri, (fractions[k] - 1.0) * wanted, now)
                if _clear(now, lengths[d], steep, wide):
                    continue
                for a in range(len(headings)):
                    for t in range(len(tilts)):
                        # most shadows fall beside the line of the crease
                        slope = beams[a, t, KY]
                        w0 = now[0, 1] + slope * now[0, 2]
                        w1 = now[1, 1] + slope * now[1, 2]
                        w2 = now[2, 1] + slope * now[2, 2]
                        if min(w0, w1, w2) > wide or max(w0, w1, w2) < -wide:
                            continue
                        lo, hi = covered_interval(now, 0.0, 0.0, lengths[d], 0.0, beams[a, t], k > 0)
                        share = min(hi, 1.0 - END_SHARE) - max(lo, END_SHARE)
                        if lo < hi and share > hidden_max * (1.0 - 2.0 * END_SHARE):
                            bits[a, row, t // PER_WORD] |= one << np.uint64((t % PER_WORD) * SAMPLES + k)


@inner
def samples_seen(mask):  # type: ignore[no-untyped-def]
    """Number of the last sample up to which some tilt shows each step of the turn; 0: none.

    ``mask`` (WORDS,) says what is hidden. A step is shown by a tilt that shows both of its ends.
    """
    one = np.uint64(1)
    low = (one << np.uint64(SAMPLES)) - one
    shown = np.uint64(0)
    for w in range(WORDS):
        seen = ~mask[w]
        for t in range(PER_WORD):
            part = (seen >> np.uint64(t * SAMPLES)) & low
            shown |= part & (part >> one)
    k = 0
    while k < SAMPLES - 1 and (shown >> np.uint64(k)) & one:
        k += 1
    return k
