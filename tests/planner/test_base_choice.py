"""Bases that were tried: figures of their trees, the bound, the order, and the way into the file and back."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.base_choice import RUNNERS_UP, base_trials, choice_of_bases
from planner.base_faces import blooming_figures, rank_bases
from planner.base_trial import BaseTrial
from planner.blooming_trees import BLOOMING_TREES, TreeGrower, blooming_tree
from planner.dual_graph import DualGraph
from planner.errors import FormatError
from planner.flat_layout import FlatLayout
from planner.fold_file import read_fold, write_fold
from planner.fold_plan import MachineLimits
from planner.make_net import make_net
from planner.nearly_blooming import nearly_blooming
from planner.net import NetCertificate
from planner.plan_folds import plan_folds
from tests.planner.goal_shapes import even_ball, rough_ball
from tests.planner.hand_nets import box_goal


@settings(max_examples=20)
@given(st.integers(12, 80), st.integers(0, 10_000), st.floats(0.2, 0.7), st.sampled_from(BLOOMING_TREES))
def test_packed_paths_share_no_crease_and_bound_the_edits(
    count: int, seed: int, depth: float, name: str
) -> None:
    graph = DualGraph(rough_ball(count, seed, depth))
    base = seed % len(graph.goal.faces)
    figures = blooming_figures(TreeGrower(graph), base, name)
    layout = FlatLayout(graph, blooming_tree(graph, base, name), base, hold_base=False)
    assert figures.overlaps == layout.overlaps
    assert figures.depth == layout.depth.max()
    paths = [set(layout.path(a, b)[~graph.flat[layout.path(a, b)]].tolist())
             for a, b in layout.overlapping_pairs().tolist()]  # fmt: skip
    # a maximal packing of the paths: no fewer than a path of each length class allows, no more than edits
    assert (figures.bound == 0) == (not paths)
    longest = max((len(path) for path in paths), default=1)
    every: set[int] = set().union(*paths) if paths else set()
    assert figures.bound <= len(every) / min((len(path) for path in paths), default=1)
    assert figures.bound >= len(paths) / max(
        1, longest * max((sum(e in p for p in paths) for e in every), default=1)
    )
    attempt = nearly_blooming(graph, base, tree=name, seed=seed)
    assert not attempt.is_net or attempt.edits >= figures.bound


def test_ranks_carry_the_bound_of_their_tree() -> None:
    graph = DualGraph(rough_ball(60, 4, 0.5))
    grower = TreeGrower(graph)
    ranks = rank_bases(graph)
    assert any(rank.bound for rank in ranks)
    for rank in ranks[:8]:
        figures = blooming_figures(grower, rank.face, rank.tree)
        assert (rank.bound, rank.overlaps, rank.depth) == (figures.bound, figures.overlaps, figures.depth)


def test_make_net_records_what_it_tried() -> None:
    goal = rough_ball(50, 3, 0.5)
    net = make_net(goal)
    bases = net.certificate.bases
    assert bases[0].face == net.base_face
    assert bases[0].edits == net.certificate.edits
    assert len({trial.face for trial in bases}) == len(bases) > 1
    assert all(trial.bound <= trial.edits for trial in bases if trial.edits >= 0)
    assert all(trial.quick_cost is None for trial in bases)
    assert make_net(goal).certificate.bases == bases
    assert make_net(goal, base_face=2).certificate.bases == ()


def test_the_plan_records_the_bases_it_folded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules["planner.plan_folds"], "EVALUATION_BUDGET", 1200)
    monkeypatch.setattr(sys.modules["planner.plan_folds"], "SHEETS", 6)
    goal = rough_ball(16, 5, 0.3)
    plan = plan_folds(make_net(goal), MachineLimits())
    bases = plan.net.certificate.bases
    assert bases[0].face == plan.net.base_face
    assert 1 < len(bases) <= RUNNERS_UP + 1
    costs = [trial.quick_cost for trial in bases[1:] if trial.quick_cost is not None]
    assert costs == sorted(costs)
    assert bases[0].quick_cost is not None
    kept = plan_folds(make_net(goal, base_face=1), MachineLimits(), fixed_base=True)
    assert kept.net.certificate.bases == ()


def test_one_record_for_each_base_and_not_too_many() -> None:
    graph = DualGraph(even_ball(40))
    attempts = [nearly_blooming(graph, base) for base in (3, 3, *range(12))]
    trials = base_trials(graph, attempts, {0: 0.5, 2: float("inf")})
    assert [trial.face for trial in trials] == [3, 0, 1, 2, *range(4, 4 + RUNNERS_UP - 3)]
    assert [trial.quick_cost for trial in trials[:2]] == [0.5, None]
    certificate = choice_of_bases(graph, 1, NetCertificate(0, 2, tree="bfs"), 0.25, trials)
    assert [trial.face for trial in certificate.bases] == [1, 3, 0, 2, *range(4, 4 + RUNNERS_UP - 3)]
    assert certificate.bases[0] == BaseTrial(1, "bfs", 0, 0, 2, 0.25)
    assert choice_of_bases(graph, 3, NetCertificate(0, 2), 0.25, trials[:1]).bases == ()
    random = nearly_blooming(graph, 0)
    assert base_trials(graph, [replace(random, tree="random")])[0].bound == 0


def test_bases_are_in_the_file(tmp_path: Path) -> None:
    net = make_net(rough_ball(40, 6, 0.5))
    bases = (*net.certificate.bases, BaseTrial(7, "bfs", 5, 2, -1, 0.125))
    net = replace(net, certificate=replace(net.certificate, bases=bases))
    path = tmp_path / "net.fold"
    write_fold(net, path)
    assert read_fold(path, net.goal).certificate.bases == bases
    data = json.loads(path.read_text())
    assert data["blossom:bases"][-1]["quick_cost"] == 0.125
    for wrong, words in (
        ({}, "expected a list"),
        ([{}], "face, tree, overlaps"),
        ([{**data["blossom:bases"][0], "edits": "2"}], "edits"),
        ([{**data["blossom:bases"][0], "tree": 2}], "tree"),
        ([{**data["blossom:bases"][0], "quick_cost": "2"}], "quick_cost"),
    ):
        path.write_text(json.dumps({**data, "blossom:bases": wrong}))
        with pytest.raises(FormatError, match=rf"blossom:bases.*{words}"):
            read_fold(path, net.goal)
    del data["blossom:bases"]
    path.write_text(json.dumps(data))
    assert read_fold(path, net.goal).certificate.bases == ()
    assert np.array_equal(read_fold(path, net.goal).vertices, net.vertices)


def test_no_choice_no_record() -> None:
    assert len(make_net(box_goal()).certificate.bases) <= 6
    assert make_net(box_goal(), base_face=0).certificate.bases == ()
