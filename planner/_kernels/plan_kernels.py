"""The greedy fold planner: a ready list with postponement, watched blockers and least-loss concession."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner._kernels.beam_kernels import BEAM_SIZE, OVERHANG_RAD, aim, lean
from planner._kernels.compiled import entry, inner
from planner._kernels.crowd_kernels import CROWD_BLOCK, bound_blocks, crowd_order
from planner._kernels.known_kernels import (
    first_marks,
    known_contact,
    known_sight,
    known_view,
    light_mark,
    mixed,
    mixed_line,
)
from planner._kernels.reach_kernels import LEAST_GAIN_RAD, never_seen

NOT_BLOCKED, BY_CONTACT, BY_SIGHT = 0, 1, 2
STEP_ROTATE, STEP_FOLD = 0, 1
SHAPE_WEIGHT, ANGLE_WEIGHT = 0.35, 1.0
"""Cost of a shape error as long as the goal, and of folding nothing: what every choice of a plan makes small."""
OVERLOAD_WEIGHT, MOST_OVERLOAD = 0.05, 4.0
"""Cost of the load on creases beyond what is safe, and where it is capped."""
STAGES = 4
"""Turns in which a crease that is hard to see may be folded."""
LEAST_FOLD_RAD = math.radians(0.5)


@entry
def turn_solids(solids, centres, members, ox, oy, ux, uy, angle):  # type: ignore[no-untyped-def]
    """Turn the ``members`` by ``angle`` (signed) about the line through (ox, oy, 0) along (ux, uy, 0)."""
    c, s = math.cos(angle), math.sin(angle)
    for m in members:
        for k in range(13):
            if k < 12:
                dx, dy, dz = solids[m, k, 0] - ox, solids[m, k, 1] - oy, solids[m, k, 2]
            else:
                dx, dy, dz = centres[m, 0] - ox, centres[m, 1] - oy, centres[m, 2]
            along, across = dx * ux + dy * uy, dy * ux - dx * uy
            turned, height = across * c - dz * s, across * s + dz * c
            x, y = ox + along * ux - turned * uy, oy + along * uy + turned * ux
            if k < 12:
                solids[m, k, 0], solids[m, k, 1], solids[m, k, 2] = x, y, height
            else:
                centres[m, 0], centres[m, 1], centres[m, 2] = x, y, height


@inner
def fold_members(  # type: ignore[no-untyped-def]
    face, first, last, order, blocks, clock, stamp, marks, flat, frozen, solids, centres, radii, present,
    ox, oy, ux, uy, angle,
):  # fmt: skip
    """Turn ``order[first:last]`` about the crease of ``face`` and note that they moved; only ``face`` may move on."""
    members = order[first:last]
    turn_solids(solids, centres, members, ox, oy, ux, uy, angle)
    turn = mixed_line(np.uint64(0), ox, oy, ux, uy, angle)
    for m in members:
        stamp[m] = clock
        marks[m] = mixed(marks[m], turn)
        flat[m] = False
        if m != face:
            frozen[m] = True
    bound_blocks(order, first, last, centres, radii, flat, present, blocks)


@inner
def release(face, parent, target, waiting, done):  # type: ignore[no-untyped-def]
    """``face`` is done: its parent waits for one less; a flat joint is done with the last one."""
    done[face] = True
    g = parent[face]
    waiting[g] -= 1
    while parent[g] >= 0 and target[g] == 0.0 and waiting[g] == 0 and not done[g]:
        done[g] = True
        g = parent[g]
        waiting[g] -= 1


@inner
def add_step(steps, used, kind, which, angle):  # type: ignore[no-untyped-def]
    """Write a step; returns the number of steps."""
    steps[used, 0], steps[used, 1], steps[used, 2] = kind, which, angle
    return used + 1


@entry
def fold_greedily(  # type: ignore[no-untyped-def]
    parent, preorder, first, last, hinges, lengths, target, rank, after, lever,
    solids, centres, radii, sharp, present, flat, panel, faces,
    rotary, fine, grazes, ex, ey, head, hidden_max, substeps, margin, use_contact, use_sight, retry, give_up, size,
    known,
):  # fmt: skip
    """Fold a net as far as it goes.

    Args:
        parent: (n,) parent face, -1 for the base.
        preorder: (n,) faces in depth-first order; the subtree of f is preorder[first[f]:last[f]].
        first, last: (n,) ranges in ``preorder``.
        hinges: (n, 4) start x, start y and unit direction of the crease in the flat net.
        lengths: (n,) lengths of the creases.
        target: (n,) wanted signed angle; 0 for the base and for flat joints.
        rank: (n,) faces in the order in which they are tried.
        after: (n,) the face whose crease is to be folded first, -1: none; kept as long as anything else can fold.
        lever: (n,) what one radian missing at this crease costs.
        solids, centres, radii, sharp, present, flat: as in ``turn_contact``; net faces first, obstacles behind.
            ``solids``, ``centres`` and ``flat`` are changed in place to the end of the plan.
        panel: (N,) number of the panel (faces joined by flat joints) of each solid, -1 for obstacles.
        faces: number of net faces.
        rotary: (K,) rotary angles to choose from, in order of preference; the first half lights the top side.
        fine: (L,) further tilts that are tried for a crease that would otherwise stay out of sight.
        grazes: (G,) as in ``farthest_view``.
        ex, ey: direction of the rotary axis in the plane of the net.
        head: where the light comes from, see ``beam_kernels``.
        hidden_max: sight rule.
        substeps: how finely sight is sampled, see ``sight_limit``.
        margin: angle kept before a contact.
        use_contact, use_sight: rules that are on.
        retry: also try conceded creases again while the way to the base is flat.
        give_up: stop once the estimated cost of what was conceded exceeds this (inf: never).
        size: longest side of the goal, mm, for that estimate.
        known: (keys, answers) of turns, see ``known_contact``; both are changed, the result is the same.

    Returns:
        (steps (S, 3): kind, face or rotary index, angle; reached (n,), cause (n,), blocker (n,), moving face
        that would touch it (n,), -1: none; free angle at the obstacle (n,))
    """
    n, total = faces, len(solids)
    options = len(rotary)
    half_options = options // 2
    angle = np.zeros(n)
    done = np.zeros(n, np.bool_)
    conceded = np.zeros(n, np.bool_)
    frozen = np.zeros(n, np.bool_)
    waiting = np.zeros(n, np.int64)
    cause = np.zeros(n, np.int64)
    blocker, toucher = np.zeros(n, np.int64), np.full(n, -1, np.int64)
    stopped_at = np.zeros(n)
    stamp, marks, light = np.zeros(total, np.int64), np.zeros(total, np.uint64), np.uint64(0)
    if len(known[0]) > 0:
        first_marks(solids, sharp, marks)
        light = light_mark(fine, grazes, ex, ey, head, hidden_max, substeps)
    contact_time, free_time = np.zeros(n, np.int64), np.zeros(n, np.int64)
    contact_by, contact_of = np.zeros(n, np.int64), np.zeros(n, np.int64)
    contact_angle = np.zeros(n)
    sight_time = np.zeros((n, options), np.int64)
    sight_by = np.zeros((n, options), np.int64)
    sight_angle = np.zeros((n, options))
    order = crowd_order(preorder, total)
    blocks = np.empty(((total + CROWD_BLOCK - 1) // CROWD_BLOCK, 5))
    bound_blocks(order, 0, total, centres, radii, flat, present, blocks)
    moving_mask, near = np.zeros(total, np.bool_), np.empty(total, np.int64)
    work, turned, intervals = np.zeros((30, 3)), np.zeros((3, 3)), np.zeros((total, 2))
    steps = np.zeros((12 * n + 16, 3))
    used = 0
    clock = 0
    lost_shape, lost_angle, wanted_angle = 0.0, 0.0, 0.0
    hopeless = np.zeros(n)
    at = 0  # rotary option now
    astray = False  # True while the rotary stands at a fine tilt instead
    beams, aimed = np.zeros((options, BEAM_SIZE)), np.zeros(BEAM_SIZE)
    for r in range(options):
        aim(rotary[r], ex, ey, head, beams[r])
    for f in range(n):
        blocker[f], contact_time[f], contact_by[f], free_time[f] = -1, -1, -1, -1
        for r in range(options):
            sight_time[f, r], sight_by[f, r] = -1, -1
        wanted_angle += abs(target[f])
        if parent[f] >= 0:
            waiting[parent[f]] += 1
    wanted_angle = max(1e-9, wanted_angle)
    if use_sight:
        never_seen(target, hinges, lengths, beams, hopeless)
        for f in range(n):
            if hopeless[f] > 0.0:
                cause[f], blocker[f] = BY_SIGHT, f
                lost = 0.5 * hopeless[f] * lever[f] / size
                lost_shape += lost * lost
                lost_angle += hopeless[f]
        if SHAPE_WEIGHT * math.sqrt(lost_shape) + ANGLE_WEIGHT * lost_angle / wanted_angle > give_up:
            return steps[:0].copy(), angle, cause, blocker, toucher, stopped_at
    # flat joints need no turn: they are done as soon as their children are
    for k in range(n - 1, -1, -1):
        f = preorder[k]
        if parent[f] >= 0 and target[f] == 0.0 and waiting[f] == 0:
            done[f] = True
            waiting[parent[f]] -= 1

    later, hurry = np.full(n, -1, np.int64), False
    for f in range(n):
        a = after[f]
        # what hangs on a crease cannot wait for it
        if a >= 0 and parent[a] >= 0 and not first[a] <= first[f] < last[a]:
            later[f] = a

    best_face: Any  # a number of one width from the start: else turn_contact is compiled for two
    best_option: Any
    reach_out = np.zeros(2)
    while True:
        best_face, best_option, best_loss = np.int64(-1), np.int64(-1), np.inf
        progressed, held = False, False
        for attempt in range(options + 1):
            # the option now in force first, then the others in the order of preference from its side
            if attempt == 0:
                r = at
            else:
                k = attempt - 1
                flipped = at >= half_options
                tilt, side = k // 2, k % 2
                if tilt == at % half_options and side == 0:
                    continue
                r = tilt + (half_options if (side == 1) != flipped else 0)
                if r == at:
                    continue
            while True:
                folded_any = False
                for f in rank:
                    if parent[f] < 0 or target[f] == 0.0 or frozen[f]:
                        continue
                    if done[f] and not (retry and conceded[f]):
                        continue
                    if waiting[f] > 0 or (target[f] > 0.0) != (r < half_options):
                        continue
                    if later[f] >= 0 and not done[later[f]] and not hurry:
                        held = True
                        continue
                    wanted = abs(target[f] - angle[f])
                    sign = 1.0 if target[f] > 0.0 else -1.0
                    ox, oy, ux, uy = hinges[f, 0], hinges[f, 1], hinges[f, 2], hinges[f, 3]
                    # failures are remembered while their witness has not moved (others may have: a cautious
                    # answer), a free turn while nothing has moved at all
                    free, seen = wanted, wanted
                    if (
                        sight_time[f, r] >= 0
                        and stamp[sight_by[f, r]] <= sight_time[f, r]
                        and stamp[f] <= sight_time[f, r]
                    ):
                        seen = sight_angle[f, r]
                    elif use_contact and free_time[f] != clock:
                        if (
                            contact_time[f] >= 0
                            and stamp[contact_by[f]] <= contact_time[f]
                            and stamp[f] <= contact_time[f]
                        ):
                            free = contact_angle[f]
                        else:
                            free, of, by = known_contact(
                                known, marks, order, blocks, f, parent[f], first[f], last[f], solids, centres, radii,
                                sharp, present, ox, oy, sign * ux, sign * uy, wanted, near, work,
                            )  # fmt: skip
                            contact_time[f] = -1
                            if by >= 0:
                                free = max(0.0, free - margin)
                                contact_time[f], contact_angle[f] = clock, free
                                contact_by[f], contact_of[f] = by, of
                            else:
                                free_time[f] = clock
                    full = free >= wanted and seen >= wanted
                    if conceded[f] and not full:
                        continue
                    seen = min(free, seen)
                    if full and use_sight:
                        # the beam must stay between the parent and the turning face
                        mx, my = ox + 0.5 * lengths[f] * ux, oy + 0.5 * lengths[f] * uy
                        own = lean(beams[r], mx, my, ux, uy, sign) + OVERHANG_RAD - abs(angle[f])
                        by, seen = f, max(0.0, own)
                        if own >= wanted:
                            seen, by = known_sight(
                                known, marks, order, blocks, light, rotary[r], f, parent[f], first[f], last[f],
                                moving_mask, panel, flat, solids, centres, radii, present, hinges[f], lengths[f],
                                sign, wanted, beams[r], hidden_max, intervals, turned, substeps, near,
                            )  # fmt: skip
                        sight_time[f, r] = -1
                        if by >= 0:
                            sight_time[f, r], sight_by[f, r], sight_angle[f, r] = clock, by, seen
                    if full and seen >= wanted:
                        if r != at or used == 0 or astray:
                            if r != 0 or used > 0:
                                used = add_step(steps, used, STEP_ROTATE, r, rotary[r])
                            at, astray = r, False
                        clock += 1
                        fold_members(
                            f, first[f], last[f], order, blocks, clock, stamp, marks, flat, frozen, solids, centres,
                            radii, present, ox, oy, ux, uy, target[f] - angle[f],
                        )  # fmt: skip
                        angle[f] = target[f]
                        used = add_step(steps, used, STEP_FOLD, f, target[f])
                        cause[f], blocker[f], toucher[f] = NOT_BLOCKED, -1, -1
                        if not done[f]:
                            release(f, parent, target, waiting, done)
                        conceded[f] = False
                        frozen[f] = True
                        folded_any = True
                        continue
                    if conceded[f]:
                        continue
                    reach = max(0.0, min(free, seen))
                    loss = (wanted - reach) * lever[f]
                    if loss < best_loss - 1e-12:
                        best_face, best_option, best_loss = f, r, loss
                        reach_out[0] = BY_SIGHT if seen < free - 1e-9 or seen < 0.0 else BY_CONTACT
                        reach_out[1] = sight_by[f, r] if reach_out[0] == BY_SIGHT else contact_by[f]
                if not folded_any:
                    break
                progressed = True
                best_face, best_loss = np.int64(-1), np.inf
            if progressed:
                break
        if progressed or (held and not hurry):
            hurry = not progressed
            continue
        if best_face < 0:
            break
        # concede the cheapest one: fold it as far as it goes, in stages if another tilt shows more of it
        f = best_face
        sign = 1.0 if target[f] > 0.0 else -1.0
        ox, oy, ux, uy = hinges[f, 0], hinges[f, 1], hinges[f, 2], hinges[f, 3]
        why, who = int(reach_out[0]), int(reach_out[1])
        # what was remembered are upper bounds: measure again, now that everything else stands still
        free = abs(target[f] - angle[f])
        if use_contact:
            free, of, by = known_contact(
                known, marks, order, blocks, f, parent[f], first[f], last[f], solids, centres, radii, sharp, present,
                ox, oy, sign * ux, sign * uy, free, near, work,
            )  # fmt: skip
            if by >= 0:
                free = max(0.0, free - margin)
                contact_time[f], contact_angle[f] = clock, free
                contact_by[f], contact_of[f] = by, of
                if why == BY_CONTACT:
                    who = by
        for _ in range(STAGES):
            view, tilted, reach = rotary[best_option], False, free
            if use_sight:
                reach, view, tilted, by = known_view(
                    known, marks, order, blocks, light, f, parent[f], first[f], last[f], moving_mask, panel, flat,
                    solids, centres, radii, present, hinges[f], lengths[f], sign, abs(angle[f]), free,
                    rotary[best_option], fine, grazes, ex, ey, head, hidden_max, substeps, beams[best_option], aimed,
                    intervals, turned, near,
                )  # fmt: skip
                if reach < free:
                    why, who = BY_SIGHT, f if by < 0 else by
            if reach <= LEAST_FOLD_RAD:
                break
            if tilted or astray or best_option != at or used == 0:
                if tilted or best_option != 0 or used > 0:
                    used = add_step(steps, used, STEP_ROTATE, best_option, view)
                at, astray = best_option, tilted
            clock += 1
            angle[f] = target[f] if reach >= abs(target[f] - angle[f]) - 1e-9 else angle[f] + sign * reach
            fold_members(
                f, first[f], last[f], order, blocks, clock, stamp, marks, flat, frozen, solids, centres, radii, present,
                ox, oy, ux, uy, sign * reach,
            )  # fmt: skip
            used = add_step(steps, used, STEP_FOLD, f, angle[f])
            free -= reach
            if not use_sight or free <= LEAST_GAIN_RAD:
                break
        if free <= LEAST_GAIN_RAD and contact_time[f] >= 0 and angle[f] != target[f]:
            why, who = BY_CONTACT, contact_by[f]
        stopped_at[f] = abs(angle[f])
        if angle[f] == target[f]:
            why, who = NOT_BLOCKED, -1
            frozen[f] = True
        cause[f], blocker[f] = why, who
        toucher[f] = contact_of[f] if why == BY_CONTACT else -1
        # cost of what is missing so far, as the search weighs it; retries may mend some of it
        missing = abs(target[f] - angle[f])
        lost, sure = 0.5 * missing * lever[f] / size, 0.5 * hopeless[f] * lever[f] / size
        lost_shape += max(0.0, lost * lost - sure * sure)
        lost_angle += max(0.0, missing - hopeless[f])
        if SHAPE_WEIGHT * math.sqrt(lost_shape) + ANGLE_WEIGHT * lost_angle / wanted_angle > give_up:
            break
        conceded[f] = angle[f] != target[f]
        release(f, parent, target, waiting, done)
    return steps[:used].copy(), angle, cause, blocker, toucher, stopped_at
