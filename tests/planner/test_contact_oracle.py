"""Turns of real plans: no fine sample with python-fcl touches before the exact first contact."""

import math

import pytest

from benchmarks.contact_oracle import Counts, compare
from models.goals import goal_path
from planner.read_goal import read_goal

MESHES = (
    "bunny-128", "bunny-348", "cat-348", "duck-348", "knight-348", "lilium-348", "snail-286", "spot-348",
)  # fmt: skip


@pytest.mark.parametrize("name", ["star", "box_with_lid"])
def test_shipped_goals_agree_with_fine_samples(name):
    counts = compare(read_goal(goal_path(name)), beyond_rad=math.radians(20.0))
    assert counts.turns >= 5
    assert counts.missed == counts.unconfirmed == 0


@pytest.mark.slow
def test_two_thousand_turns_of_real_plans_agree_with_fine_samples(shared_meshes):
    total = Counts()
    for name in MESHES:
        total += compare(read_goal(shared_meshes / "real" / f"{name}.obj", size_mm=60.0))
    assert total.turns >= 2000
    assert total.contacts > 50
    assert total.missed == total.unconfirmed == 0
