"""Turns that were worked out before: an answer is looked up if all that it depends on is as it was then.

Nets that follow each other in a search differ in few places, so most of their turns are alike. Every solid has a
mark, a hash of all numbers that its position came from. The marks of what turns and of what is near enough to matter,
with the rest of the question, are the key under which the answer is kept. It has 64 bits: that two questions share
one happens about once in 10^11 plans of 348 faces. Answers are what the kernels would give, to the last bit.
"""

from __future__ import annotations

import numpy as np

from planner._kernels.beam_kernels import HEAD_FINITE, HEAD_OY
from planner._kernels.compiled import inner
from planner._kernels.contact_kernels import listed_contact
from planner._kernels.crowd_kernels import near_sight, near_turn
from planner._kernels.reach_kernels import farthest_view
from planner._kernels.sight_kernels import sight_limit

CONTACT, SIGHT, VIEW = 1, 2, 3
"""Kinds of questions, as parts of their keys."""


@inner
def mixed(a, b):  # type: ignore[no-untyped-def]
    """Hash of a hash and a number; the last steps are those of splitmix64 (Steele, Lea and Flood 2014)."""
    x = (np.uint64(a) * np.uint64(0x9E3779B97F4A7C15)) ^ np.uint64(b)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@inner
def mixed_real(a, b):  # type: ignore[no-untyped-def]
    """Hash of a hash and the bits of a real number."""
    return mixed(a, np.float64(b).view(np.uint64))


@inner
def mixed_line(a, ox, oy, ux, uy, angle):  # type: ignore[no-untyped-def]
    """Hash of a hash and a turn by an angle about a line."""
    return mixed_real(mixed_real(mixed_real(mixed_real(mixed_real(a, ox), oy), ux), uy), angle)


@inner
def first_marks(solids, sharp, marks):  # type: ignore[no-untyped-def]
    """Marks (N,) of the solids in their first position, with their numbers."""
    for s in range(len(solids)):
        a = mixed(np.uint64(s + 1), np.uint64(sharp[s]))
        for k in range(12):
            for d in range(3):
                a = mixed_real(a, solids[s, k, d])
        marks[s] = a


@inner
def light_mark(fine, grazes, ex, ey, head, hidden_max, substeps):  # type: ignore[no-untyped-def]
    """Hash of what sight depends on in a whole plan, see ``fold_greedily``."""
    a = mixed_real(mixed_real(mixed_real(np.uint64(substeps), hidden_max), ex), ey)
    for angle in fine:
        a = mixed_real(a, angle)
    for angle in grazes:
        a = mixed_real(a, angle)
    for k in range(len(head)):
        if head[HEAD_FINITE] != 0.0 or k > HEAD_OY:  # where parallel light comes from does not matter
            a = mixed_real(a, head[k])
    return a


@inner
def _kept(known, key):  # type: ignore[no-untyped-def]
    """Row of a key, and whether its answer is there."""
    row = np.int64(key & np.uint64(len(known[0]) - 1))
    return row, known[0][row] == key


@inner
def _sum_of_marks(marks, solids):  # type: ignore[no-untyped-def]
    """Mark of a set of solids, in whatever order."""
    total = np.uint64(0)
    for s in solids:
        total += marks[s]
    return total


@inner
def _mark(mask, members, value):  # type: ignore[no-untyped-def]
    """Set ``mask`` of the ``members``."""
    for m in members:
        mask[m] = value


@inner
def known_contact(  # type: ignore[no-untyped-def]
    known, marks, order, blocks, face, parent, first, last, solids, centres, radii, sharp, present,
    ox, oy, ux, uy, limit, near, work,
):  # fmt: skip
    """``turn_contact``, looked up if it is known.

    Args:
        known: (K,) keys and (K, 4) answers, K a power of 2, or 0: nothing is looked up.
        marks: (N,) marks of the solids now.
        order, blocks: see ``crowd_kernels``; the faces ``order[first:last]`` turn.
        face ... limit, work: as in ``turn_contact``.
        near: (N,) work space.
    """
    keys, answers = known
    row, key = np.int64(0), np.uint64(0)
    members = order[first:last]
    count = near_turn(order, blocks, first, last, centres, radii, present, ox, oy, ux, uy, near)
    if count == 0:
        return limit, np.int64(-1), np.int64(-1)
    if len(keys) > 0:
        key = mixed(
            mixed(np.uint64(CONTACT), _sum_of_marks(marks, members)), _sum_of_marks(marks, near[:count])
        )
        key = mixed_line(mixed(mixed(key, face), parent), ox, oy, ux, uy, limit)
        row, there = _kept(known, key)
        if there:
            return answers[row, 0], np.int64(answers[row, 1]), np.int64(answers[row, 2])
    free, of, by = listed_contact(
        face, parent, members, near[:count], solids, centres, radii, sharp, ox, oy, ux, uy, limit, work
    )
    if len(keys) > 0:
        keys[row], answers[row, 0], answers[row, 1], answers[row, 2] = key, free, of, by
    return free, of, by


@inner
def _sight_key(kind, light, marks, turning, still, face, hinge, length, sign):  # type: ignore[no-untyped-def]
    """Key of a question of sight, without its angles; ``turning`` and ``still``: what may hide the crease."""
    key = mixed(mixed(np.uint64(kind), light), _sum_of_marks(marks, turning))
    key = mixed_real(mixed(mixed(key, _sum_of_marks(marks, still)), face), sign)
    return mixed_line(key, hinge[0], hinge[1], hinge[2], hinge[3], length)


@inner
def known_sight(  # type: ignore[no-untyped-def]
    known, marks, order, blocks, light, rotary, face, parent, first, last, moving_mask, panel, flat,
    solids, centres, radii, present, hinge, length, sign, limit, beam, hidden_max, intervals, turned, substeps, near,
):  # fmt: skip
    """``sight_limit`` without its refinement, looked up if it is known.

    Args:
        known, marks, order, blocks, near: as in ``known_contact``.
        light: see ``light_mark``.
        rotary: the angle of the ``beam``.
        face, parent, first, last, moving_mask, hinge, length: as in ``farthest_view``.
        panel ... substeps: as in ``sight_limit``.
    """
    keys, answers = known
    row, key = np.int64(0), np.uint64(0)
    turning, count = near_sight(
        order, blocks, first, last, panel[face], panel[parent], panel, flat, centres, radii, present,
        hinge, length, sign, limit, beam, 0.0, near,
    )  # fmt: skip
    if count == 0:
        return limit, np.int64(-1)
    if len(keys) > 0:
        key = _sight_key(SIGHT, light, marks, near[:turning], near[turning:count], face, hinge, length, sign)
        key = mixed_real(mixed_real(key, rotary), limit)
        row, there = _kept(known, key)
        if there:
            return answers[row, 0], np.int64(answers[row, 1])
    _mark(moving_mask, near[:turning], True)
    seen, by = sight_limit(
        panel[face], panel[parent], panel, moving_mask, flat, solids, centres, radii, near[:count],
        hinge[0], hinge[1], hinge[2], hinge[3], length, sign, limit, beam, hidden_max, intervals, turned,
        substeps, False,
    )  # fmt: skip
    _mark(moving_mask, near[:turning], False)
    if len(keys) > 0:
        keys[row], answers[row, 0], answers[row, 1] = key, seen, by
    return seen, by


@inner
def known_view(  # type: ignore[no-untyped-def]
    known, marks, order, blocks, light, face, parent, first, last, moving_mask, panel, flat,
    solids, centres, radii, present, hinge, length, sign, now, free, rotary, fine, grazes, ex, ey, head, hidden_max,
    substeps, beam, aimed, intervals, turned, near,
):  # fmt: skip
    """``farthest_view``, looked up if it is known.

    Args:
        known, marks, order, blocks, light, near: as in ``known_sight``.
        face ... substeps: as in ``farthest_view``, ``rotary`` the angle that is tried first.
        beam: at this angle.
        aimed, intervals, turned: as in ``farthest_view``.
    """
    keys, answers = known
    row, key, most = np.int64(0), np.uint64(0), 0.0
    for tilt in fine:
        most = max(most, abs(tilt))
    turning, count = near_sight(
        order, blocks, first, last, panel[face], panel[parent], panel, flat, centres, radii, present,
        hinge, length, sign, free, beam, most, near,
    )  # fmt: skip
    if len(keys) > 0:
        key = _sight_key(VIEW, light, marks, near[:turning], near[turning:count], face, hinge, length, sign)
        key = mixed_real(mixed_real(mixed_real(key, rotary), now), free)
        row, there = _kept(known, key)
        if there:
            return answers[row, 0], answers[row, 1], answers[row, 2] != 0.0, np.int64(answers[row, 3])
    _mark(moving_mask, near[:turning], True)
    reach, view, tilted, who = farthest_view(
        face, parent, moving_mask, panel, flat, solids, centres, radii, near[:count],
        hinge, length, sign, now, free, rotary, fine, grazes, ex, ey, head, hidden_max, substeps, aimed,
        intervals, turned,
    )  # fmt: skip
    _mark(moving_mask, near[:turning], False)
    if len(keys) > 0:
        keys[row], answers[row, 0], answers[row, 1], answers[row, 2], answers[row, 3] = (
            key, reach, view, 1.0 if tilted else 0.0, who,
        )  # fmt: skip
    return reach, view, tilted, who
