"""From a net to a proven one around the same base."""

from __future__ import annotations

import numpy as np

from planner.blooming_trees import BLOOMING_TREES
from planner.fold_file import write_fold
from planner.make_net import make_net
from planner.net_proof import verify_fold
from planner.overlap import overlapping_faces
from planner.prove_edits import prove_edits
from tests.planner.goal_shapes import rough_ball


def test_the_proven_net_is_no_worse_and_its_file_holds(tmp_path) -> None:
    told: list[tuple[int, int, float]] = []
    for seed in range(3):
        told.clear()
        goal = rough_ball(16, seed, 0.6)
        net = make_net(goal, method="nb", seed=seed)
        proven = prove_edits(net, seconds=20.0, progress=lambda *figures: told.append(figures))
        assert told
        assert proven.base_face == net.base_face
        assert proven.certificate.tree == net.certificate.tree
        assert proven.certificate.edits <= net.certificate.edits
        assert proven.certificate.optimal
        assert [t.face for t in proven.certificate.bases] == [t.face for t in net.certificate.bases]
        assert overlapping_faces(proven) == []
        write_fold(proven, tmp_path / "net.fold")
        check = verify_fold(tmp_path / "net.fold", goal)
        assert check.holds
        assert check.optimal
        assert check.lower_bound == proven.certificate.edits


def test_a_random_net_is_proven_against_a_blooming_tree() -> None:
    goal = rough_ball(10, 1, 0.2)
    net = make_net(goal, method="random", seed=2)
    proven = prove_edits(net, seconds=20.0)
    assert proven.certificate.tree in BLOOMING_TREES
    assert proven.certificate.optimal
    assert np.array_equal(proven.goal.faces, goal.faces)


def test_no_time_is_no_proof_but_a_net() -> None:
    net = make_net(rough_ball(30, 4, 0.6))
    proven = prove_edits(net, seconds=1e-6)
    assert overlapping_faces(proven) == []
    assert 0 <= proven.certificate.lower_bound <= proven.certificate.edits <= net.certificate.edits
