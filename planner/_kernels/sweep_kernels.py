"""Which bodies of the sheet a sequence of folds sweeps."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from planner._kernels.contact_kernels import turn_contact
from planner._kernels.plan_kernels import turn_solids


@njit(cache=True)
def swept_sheet(  # type: ignore[no-untyped-def]
    crease_faces, angles, preorder, first, last, hinges, solids, centres, radii,
    sheet, sheet_centres, sheet_radii,
):  # fmt: skip
    """For each sheet body, the first fold that sweeps it, or -1.

    Args:
        crease_faces: (K,) child face of each fold.
        angles: (K,) absolute angle after each fold, rad.
        preorder, first, last: subtree ranges, as from ``subtree_ranges``.
        hinges: (F, 4) start and unit direction of every crease in the flat net.
        solids, centres, radii: the net faces in the flat state; changed in place to the end of the plan.
        sheet, sheet_centres, sheet_radii: the bodies of the sheet, as solids.
    """
    count, bodies = len(solids), len(sheet)
    out = np.full(bodies, -1, np.int64)
    angle = np.zeros(count)
    one = np.empty((count + 1, 12, 3))
    one_centres, one_radii = np.empty((count + 1, 3)), np.empty(count + 1)
    mask, present = np.zeros(count + 1, np.bool_), np.zeros(count + 1, np.bool_)
    sharp = np.zeros(count + 1, np.bool_)
    work = np.empty((30, 3))
    present[count] = True
    one_radii[:count] = radii
    for k in range(len(crease_faces)):
        f = crease_faces[k]
        turn = angles[k] - angle[f]
        members = preorder[first[f] : last[f]]
        ox, oy, ux, uy = hinges[f, 0], hinges[f, 1], hinges[f, 2], hinges[f, 3]
        sign = 1.0 if turn > 0.0 else -1.0
        reach = 0.0
        for m in members:
            one[m] = solids[m]
            one_centres[m] = centres[m]
            mask[m] = True
            reach = max(
                reach,
                math.sqrt((centres[m, 0] - ox) ** 2 + (centres[m, 1] - oy) ** 2 + centres[m, 2] ** 2)
                + radii[m],
            )
        for b in range(bodies):
            if out[b] >= 0:
                continue
            away = math.sqrt((sheet_centres[b, 0] - ox) ** 2 + (sheet_centres[b, 1] - oy) ** 2)
            if away > reach + sheet_radii[b]:
                continue
            one[count] = sheet[b]
            one_centres[count] = sheet_centres[b]
            one_radii[count] = sheet_radii[b]
            _, hit, _ = turn_contact(
                f, -2, members, mask, one, one_centres, one_radii, sharp, present,
                ox, oy, sign * ux, sign * uy, abs(turn), work,
            )  # fmt: skip
            if hit >= 0:
                out[b] = k
        for m in members:
            mask[m] = False
        turn_solids(solids, centres, members, ox, oy, ux, uy, turn)
        angle[f] = angles[k]
    return out
