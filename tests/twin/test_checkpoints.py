"""Checkpoints: from each of them the run goes on to the same bits."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.fold_plan import Fold, FoldPlan, Rotate
from tests.twin.hand_plans import box, breadth_first_net, icosahedron, outside_in_steps, plan_of, star
from tests.twin.test_dynamics import BLIND, SOFT
from twin.checkpoint_file import read_checkpoints, write_checkpoints
from twin.dynamics import dynamic_run
from twin.errors import RecordFileError
from twin.hinge_law import STEEL_304, SheetMetal
from twin.mjcf_model import compile_model
from twin.record_file import record_bytes
from twin.sweep import kinematic_sweep


def tilted() -> FoldPlan:
    """Folds with rotations between them, so that gravity turns on the way."""
    net = breadth_first_net(star())
    steps: list = []
    for number, step in enumerate(outside_in_steps(net)):
        steps.append(step)
        if isinstance(step, Rotate):
            steps[-1] = Rotate(step.to_rad + 0.1 * (number % 3))
    return plan_of(net, steps)


@pytest.mark.parametrize(
    ("plan", "metal", "drive"),
    [
        (tilted(), STEEL_304, "springyield"),
        (plan_of(breadth_first_net(icosahedron())), STEEL_304, "springyield"),
        (plan_of(breadth_first_net(box(20, 20, 20))), SOFT, "springyield"),  # touches: slower runs
        (plan_of(breadth_first_net(star())), STEEL_304, "actuator"),
    ],
)
def test_every_step_can_be_started_again_bit_for_bit(plan: FoldPlan, metal: SheetMetal, drive) -> None:
    compiled = compile_model(plan, metal, drive=drive)
    sweep = kinematic_sweep(compiled, plan)
    whole = dynamic_run(compiled, plan, sweep, settings=BLIND)
    folds = [n for n, s in enumerate(plan.steps) if isinstance(s, Fold)]
    assert [c.step for c in whole.checkpoints] == [-1, *folds]
    for start in whole.checkpoints:
        part = dynamic_run(compiled, plan, sweep, settings=BLIND, start=start)
        assert part.state_sha256 == whole.state_sha256
        assert np.array_equal(part.angles_rad, whole.angles_rad)
        assert (part.steps, part.yield_share, part.tab_moment_n_m) == (
            whole.steps, whole.yield_share, whole.tab_moment_n_m,
        )  # fmt: skip
        assert part.noted == tuple(e for e in whole.noted if e.step > start.step)


def test_file_holds_checkpoints(tmp_path: Path) -> None:
    plan = plan_of(breadth_first_net(star()))
    compiled = compile_model(plan)
    whole = dynamic_run(compiled, plan, kinematic_sweep(compiled, plan), settings=BLIND)
    path, other = tmp_path / "c.npz", tmp_path / "d.npz"
    write_checkpoints(path, whole.checkpoints, whole.state_sha256, {"plan": "p" * 64})
    kept = read_checkpoints(path)
    assert kept.hashes == {"plan": "p" * 64}
    assert kept.state_sha256 == whole.state_sha256
    for mine, theirs in zip(whole.checkpoints, kept.at, strict=True):
        assert np.array_equal(mine.state, theirs.state) and np.array_equal(mine.gravity, theirs.gravity)
        assert (mine.step, mine.steps, mine.rotary_rad) == (theirs.step, theirs.steps, theirs.rotary_rad)
    write_checkpoints(other, kept.at, kept.state_sha256, kept.hashes)
    assert path.read_bytes() == other.read_bytes()
    assert kept.before(len(plan.steps)).step == kept.at[-1].step
    assert kept.before(0).step == -1
    with pytest.raises(RecordFileError, match="no checkpoint"):
        replace(kept, at=()).before(3)


def test_damaged_files_are_refused_in_words(tmp_path: Path) -> None:
    path = tmp_path / "c.npz"
    write_checkpoints(path, (), "s", {})
    good = path.read_bytes()
    head = {"format": "metal-blossom/checkpoints", "version": 1}
    none = {"figures": np.zeros((0, 8)), "states": np.zeros((0, 5))}
    others = (
        record_bytes(head | {"format": "metal-blossom/black-box"}, none),
        record_bytes(head, none),
        record_bytes(head | {"hashes": {}}, none | {"figures": np.zeros((1, 8))}),
        record_bytes(head | {"hashes": {}}, none | {"figures": np.full((0, 7), np.nan)}),
    )
    for data in (b"", good[:-30], b"PK\x03\x04" + good[40:], *others):
        path.write_bytes(data)
        with pytest.raises(RecordFileError, match="validate again"):
            read_checkpoints(path)


def test_a_checkpoint_of_another_model_is_refused() -> None:
    plan, other = plan_of(breadth_first_net(star())), plan_of(breadth_first_net(star(7)))
    compiled = compile_model(plan)
    start = dynamic_run(compiled, plan, kinematic_sweep(compiled, plan), settings=BLIND).checkpoints[1]
    model = compile_model(other)
    with pytest.raises(RecordFileError, match="of another model"):
        dynamic_run(model, other, kinematic_sweep(model, other), start=start)
