"""One turn out of a partly folded net: pose the state, and how far one crease turns from there."""

from __future__ import annotations

import numpy as np

from planner._kernels.beam_kernels import BEAM_SIZE, OVERHANG_RAD, aim, lean
from planner._kernels.compiled import entry
from planner._kernels.contact_kernels import turn_contact
from planner._kernels.plan_kernels import BY_CONTACT, BY_SIGHT, NOT_BLOCKED, turn_solids
from planner._kernels.sight_kernels import SIGHT_SUBSTEPS, sight_limit


@entry
def pose_state(  # type: ignore[no-untyped-def]
    angle, preorder, first, last, hinges, flat_solids, flat_centres, solids, centres, flat,
):  # fmt: skip
    """Fold the flat net to the angles of an outside-in state, where the way to every turned crease was flat.

    Args:
        angle: (n,) angle at the crease of each face.
        preorder, first, last: depth-first order and ranges of the subtrees.
        hinges: (n, 4) creases in the flat net.
        flat_solids, flat_centres: of the flat net, obstacles behind.
        solids, centres, flat: are overwritten.
    """
    solids[:] = flat_solids
    centres[:] = flat_centres
    flat[:] = True
    for k in range(len(preorder) - 1, 0, -1):
        f = preorder[k]
        if angle[f] != 0.0:
            members = preorder[first[f] : last[f]]
            turn_solids(
                solids, centres, members, hinges[f, 0], hinges[f, 1], hinges[f, 2], hinges[f, 3], angle[f]
            )
            for m in members:
                flat[m] = False


@entry
def turn_reach(  # type: ignore[no-untyped-def]
    face, parent, members, moving_mask, panel, flat, solids, centres, radii, sharp, present,
    hinge, length, sign, now, wanted, options, rotary, ex, ey, head, hidden_max, margin,
    use_contact, use_sight, work, intervals, turned,
):  # fmt: skip
    """How far one crease turns out of a state, and under which rotary angle it turns farthest.

    Args:
        face: the face at the crease, with its ``parent`` and the ``members`` that turn with it.
        moving_mask: (N,) work space; False for all afterwards.
        panel, flat, solids, centres, radii, sharp, present: as in ``fold_greedily``, in this state.
        hinge: (4,) the crease in the flat net, and its ``length``.
        sign: +1 for a valley, -1 for a mountain.
        now: |angle| in this state.
        wanted: further turn, > 0.
        options: indices into ``rotary`` of angles that light the right side; the first that lets the crease
            turn all the way is taken, else the one that lets it turn farthest.
        rotary, ex, ey, head, hidden_max, margin, use_contact, use_sight: as in ``fold_greedily``.
        work, intervals, turned: work space as there.

    Returns:
        (turn, option, cause, solid that stops it, -1 if none)
    """
    ox, oy, ux, uy = hinge[0], hinge[1], hinge[2], hinge[3]
    free, cause, blocker = wanted, NOT_BLOCKED, -1
    if use_contact:
        free, _, blocker = turn_contact(
            face, parent, members, moving_mask, solids, centres, radii, sharp, present,
            ox, oy, sign * ux, sign * uy, wanted, work,
        )  # fmt: skip
        if blocker >= 0:
            free, cause = max(0.0, free - margin), BY_CONTACT
    if not use_sight:
        return free, options[0], cause, blocker
    for m in members:
        moving_mask[m] = True
    suspects = np.flatnonzero(present)
    best, best_option, best_by = -1.0, options[0], -1
    beam = np.empty(BEAM_SIZE)
    mx, my = ox + 0.5 * length * ux, oy + 0.5 * length * uy
    for r in options:
        aim(rotary[r], ex, ey, head, beam)
        limit = max(0.0, min(free, lean(beam, mx, my, ux, uy, sign) + OVERHANG_RAD - now))
        if limit > best:
            seen, by = sight_limit(
                panel[face], panel[parent], panel, moving_mask, flat, solids, centres, radii, suspects,
                ox, oy, ux, uy, length, sign, limit, beam, hidden_max, intervals, turned, SIGHT_SUBSTEPS, True,
            )  # fmt: skip
            if seen > best:
                best, best_option, best_by = seen, r, by
            if best >= free:
                break
    for m in members:
        moving_mask[m] = False
    if best < free:
        cause, blocker = BY_SIGHT, face if best_by < 0 else best_by
    return max(0.0, best), best_option, cause, blocker
