"""The replay of rule 5 passes whole plans and catches broken ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely

from planner.fabrication import fabrication_steps
from planner.fold_plan import Clip, Cut, Fold, Release
from planner.held_check import check_held
from tests.planner.hand_plans import plan_for, some_nets

NETS = some_nets()


def free_triangles(plan):
    return np.flatnonzero(~plan.sheet.frame_faces)


@pytest.mark.parametrize("name", NETS)
@pytest.mark.parametrize("share", [0.0, 0.1, 0.3])
def test_plans_of_the_project_pass(name, share):
    whole = plan_for(NETS[name])
    free = free_triangles(whole)
    hits = np.random.default_rng(1).choice(free, int(share * len(free)), replace=False).tolist()
    plan = plan_for(NETS[name], hits)
    assert check_held(plan) == []
    kinds = [type(step) for step in plan.steps]
    assert kinds[-1] is Release
    first_fold = kinds.index(Fold) if Fold in kinds else len(kinds)
    assert all(k not in (Cut, Clip) for k in kinds[first_fold:])


@pytest.fixture(scope="module")
def good():
    whole = plan_for(NETS["wedge"])
    hits = np.random.default_rng(1).choice(free_triangles(whole), 25, replace=False).tolist()
    return plan_for(NETS["wedge"], hits)


def index(plan, kind, which=0):
    return [n for n, step in enumerate(plan.steps) if isinstance(step, kind)][which]


def without_step(plan, n):
    return replace(plan, steps=plan.steps[:n] + plan.steps[n + 1 :])


def test_a_forgotten_cut_is_found(good):
    for n, step in enumerate(good.steps):
        if isinstance(step, Cut):
            assert check_held(without_step(good, n)), step.why


def test_every_single_forgotten_path_is_found(good):
    for n, step in enumerate(good.steps):
        if not isinstance(step, Cut):
            continue
        for k, path in enumerate(step.paths):
            if shapely.LineString(path).length < 2.0 * good.limits.kerf:
                continue  # the short way into a corner: the contour alone may free the faces there
            less = Cut(step.paths[:k] + step.paths[k + 1 :], step.why)
            broken = replace(good, steps=(*good.steps[:n], less, *good.steps[n + 1 :]))
            assert check_held(broken), (step.why, k)


def test_a_fold_before_its_cuts_is_found(good):
    fold = good.steps[index(good, Fold)]
    problems = check_held(replace(good, steps=(fold, *good.steps)))
    assert any(f"step 0: crease {fold.crease} turns while" in line for line in problems)


def test_cutting_the_tabs_too_early_is_found(good):
    release = good.steps[index(good, Release)]
    first = index(good, Fold)
    steps = (*good.steps[:first], Cut(release.paths), *good.steps[first:])
    problems = check_held(replace(good, steps=steps))
    assert any("base face 0 is no longer joined to the frame" in line for line in problems)


def test_a_missing_clip_is_found(good):
    problems = check_held(without_step(good, index(good, Clip)))
    assert any("comes loose and is not clipped" in line for line in problems)


def test_clipping_what_still_hangs_on_the_sheet_is_found(good):
    n = index(good, Clip)
    clipped = set(good.steps[n].faces)
    more = next(t for t in free_triangles(good).tolist() if t not in clipped)
    steps = (*good.steps[:n], Clip((*good.steps[n].faces, more)), *good.steps[n + 1 :])
    assert any("still joined" in line for line in check_held(replace(good, steps=steps)))


def test_clipping_the_frame_is_found(good):
    frame = int(np.flatnonzero(good.sheet.frame_faces)[0])
    n = index(good, Clip)
    steps = (*good.steps[:n], Clip((*good.steps[n].faces, frame)), *good.steps[n + 1 :])
    assert any("clamped frame" in line for line in check_held(replace(good, steps=steps)))


def test_a_part_that_is_never_released_is_found(good):
    n = index(good, Release)
    assert any("never releases" in line for line in check_held(without_step(good, n)))
    steps = (*good.steps[:n], Release(good.steps[n].paths[:1]))
    assert any("leaves the part joined" in line for line in check_held(replace(good, steps=steps)))


def test_a_cut_through_a_crease_is_found(good):
    """Severing a petal is not a way to free it."""
    crease = good.steps[index(good, Fold)].crease
    line = tuple(map(tuple, good.net.vertices[good.net.edges[crease]].tolist()))
    first = index(good, Fold)
    steps = (*good.steps[:first], Cut((line,)), *good.steps[first:])
    assert any("no longer joined" in text for text in check_held(replace(good, steps=steps)))


def test_a_fold_of_no_crease_is_found(good):
    edge = int(np.flatnonzero(good.net.assignment == "B")[0])
    n = index(good, Fold)
    steps = (*good.steps[:n], Fold(edge, 0.5), *good.steps[n:])
    assert any("not a crease" in line for line in check_held(replace(good, steps=steps)))


def test_steps_are_the_same_every_time(good):
    from planner.holding import hold_base

    hits = [t for s in good.steps if isinstance(s, Clip) for t in s.faces]
    folds = [s for s in good.steps if isinstance(s, Fold)]
    both = [
        fabrication_steps(
            good.net, good.sheet, hold_base(good.net, good.sheet, good.limits, hits), folds, hits
        )
        for _ in range(2)
    ]
    assert both[0] == both[1]
