"""Proofs in files: they come back whole, hold when they are true, and are refused when changed."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.blooming_trees import BLOOMING_TREES, blooming_tree
from planner.dual_graph import DualGraph
from planner.errors import FormatError
from planner.fewest_edits import prove_net
from planner.flat_layout import FlatLayout
from planner.fold_file import read_fold, write_fold
from planner.goal_mesh import GoalMesh
from planner.make_net import make_net
from planner.net import Net
from planner.net_proof import NetProof, verify_fold
from planner.proof_check import check_proof
from tests.planner.goal_shapes import rough_ball
from tests.planner.hand_nets import box_goal

GOAL = rough_ball(60, 1, 0.7)


@pytest.fixture(scope="module")
def net() -> Net:
    """A net whose proof has case distinctions."""
    proven = prove_net(DualGraph(GOAL), 5, tree="steepest", seconds=60.0)
    assert proven.optimal
    assert len(proven.proof.branches) > 2
    return proven.attempt.to_net("exact")


def proof_of(net: Net) -> NetProof:
    assert net.certificate.proof is not None
    return net.certificate.proof


def test_a_true_proof_holds_and_comes_back_whole(net: Net, tmp_path: Path) -> None:
    path = tmp_path / "net.fold"
    write_fold(net, path)
    assert read_fold(path, GOAL).certificate == net.certificate
    check = verify_fold(path, GOAL)
    assert check.holds
    assert check.optimal
    assert check.edits == check.lower_bound == net.certificate.edits
    assert check.no_goods == len(proof_of(net).no_goods) > 0
    write_fold(read_fold(path, GOAL), tmp_path / "again.fold")
    assert path.read_bytes() == (tmp_path / "again.fold").read_bytes()


def test_the_quick_bound_of_nb_holds_and_is_more_than_one(tmp_path: Path) -> None:
    bounds = []
    for seed in range(6):
        goal = rough_ball(40, seed, 0.7)
        write_fold(make_net(goal, base_face=3), tmp_path / "net.fold")
        check = verify_fold(tmp_path / "net.fold", goal)
        assert check.holds
        bounds.append(check.lower_bound)
    assert max(bounds) > 1


def certificate_of(data: dict[str, Any]) -> dict[str, Any]:
    found = data["blossom:certificate"]
    assert isinstance(found, dict)
    return found


def smaller_multipliers(data: dict[str, Any]) -> None:
    rows = certificate_of(data)["proof"]["multipliers"]
    rows[:] = [[[item, times // 3] for item, times in row] for row in rows]


def larger_multipliers(data: dict[str, Any]) -> None:
    rows = certificate_of(data)["proof"]["multipliers"]
    rows[:] = [[[item, times * 50] for item, times in row] for row in rows]


def dropped_branch(data: dict[str, Any]) -> None:
    branches = certificate_of(data)["proof"]["branches"]
    first = next(node for node in branches if "edge" in node)
    first["cut"] = first["kept"]


def shorter_branches(data: dict[str, Any]) -> None:
    certificate_of(data)["proof"]["branches"].pop()


def one_sided_root(data: dict[str, Any]) -> None:
    certificate_of(data)["proof"]["branches"][0] = {"multipliers": 0}


def shortened_path(data: dict[str, Any]) -> None:
    items = certificate_of(data)["proof"]["no_goods"]
    item = max((item for item in items if item["why"] == "overlap"), key=lambda item: len(item["edges"]))
    item["edges"] = item["edges"][:1]


def other_faces(data: dict[str, Any]) -> None:
    item = next(i for i in certificate_of(data)["proof"]["no_goods"] if i["why"] == "overlap")
    item["faces"] = item["faces"][::-1]


def greedy_no_good(data: dict[str, Any]) -> None:
    for item in certificate_of(data)["proof"]["no_goods"]:
        item["cut_at_least"] += 1


def overlap_called_hold(data: dict[str, Any]) -> None:
    for item in certificate_of(data)["proof"]["no_goods"]:
        item["why"] = "hold"


def overlap_called_vertex(data: dict[str, Any]) -> None:
    for item in certificate_of(data)["proof"]["no_goods"]:
        item["why"] = "vertex"
        item["faces"] = [item["edges"][0][0]] * 2


def edge_that_is_not_there(data: dict[str, Any]) -> None:
    certificate_of(data)["proof"]["no_goods"][0]["edges"][0] = [0, 0]


def larger_bound(data: dict[str, Any]) -> None:
    certificate_of(data)["proof"]["bound"] += 1
    certificate_of(data)["lower_bound"] += 1


def no_proof(data: dict[str, Any]) -> None:
    del certificate_of(data)["proof"]


def fewer_edits(data: dict[str, Any]) -> None:
    certificate_of(data)["edits"] -= 1


def other_tree(data: dict[str, Any]) -> None:
    found = certificate_of(data)
    found["tree"] = next(name for name in BLOOMING_TREES if name != found["tree"])


def other_base(data: dict[str, Any]) -> None:
    data["blossom:base_face"] = (data["blossom:base_face"] + 7) % len(GOAL.faces)


CHANGES: list[Callable[[dict[str, Any]], None]] = [
    smaller_multipliers, larger_multipliers, dropped_branch, shorter_branches, one_sided_root, shortened_path,
    other_faces, greedy_no_good, overlap_called_hold, overlap_called_vertex, edge_that_is_not_there,
    larger_bound, no_proof, fewer_edits, other_tree, other_base,
]  # fmt: skip


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
def test_changed_files_are_refused(
    net: Net, tmp_path: Path, change: Callable[[dict[str, Any]], None]
) -> None:
    path = tmp_path / "net.fold"
    write_fold(net, path)
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))
    check = verify_fold(path, GOAL)
    assert not check.holds
    assert not check.optimal
    assert check.problems


@settings(max_examples=60)
@given(st.data())
def test_no_change_of_the_numbers_proves_more_than_is_true(net: Net, data: st.DataObject) -> None:
    proof = proof_of(net)
    rows = [dict(row) for row in proof.multipliers]
    for row in rows:
        for item in list(row):
            if data.draw(st.booleans()):
                row[item] = data.draw(st.integers(0, 3 * proof.denominator))
    forged = replace(
        proof,
        multipliers=tuple(tuple(row.items()) for row in rows),
        bound=data.draw(st.integers(0, 3 * proof.bound)),
    )
    graph = DualGraph(GOAL)
    name = next(tree for tree in BLOOMING_TREES if tree == net.certificate.tree)
    bound, _, _ = check_proof(graph, net.base_face, blooming_tree(graph, net.base_face, name), forged)
    assert bound <= net.certificate.edits


def test_an_overlapping_net_is_refused(tmp_path: Path) -> None:
    for seed in range(20):
        goal = rough_ball(30, seed, 0.7)
        graph = DualGraph(goal)
        attempt = make_overlapping(graph)
        write_fold(attempt, tmp_path / "net.fold")
        check = verify_fold(tmp_path / "net.fold", goal)
        if not check.holds:
            assert any("overlap" in problem for problem in check.problems)
            return
    raise AssertionError("no blooming tree of these bodies overlaps")


def make_overlapping(graph: DualGraph) -> Net:
    """The net of a blooming tree as it is."""
    return FlatLayout(graph, blooming_tree(graph, 0), 0).to_net()


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("no_goods", 5, "no_goods is missing or not a list"),
        ("branches", [{"edge": [1]}], "kept is a whole number"),
        ("denominator", -1, "denominator is a whole number"),
        ("multipliers", [[1]], "expected 2 numbers"),
        ("bound", True, "bound is a whole number"),
        ("whole_panels", 1, "whole_panels is true or false"),
    ],
)
def test_malformed_proofs_are_refused_in_words(
    net: Net, tmp_path: Path, key: str, value: object, message: str
) -> None:
    path = tmp_path / "net.fold"
    write_fold(net, path)
    data = json.loads(path.read_text())
    certificate_of(data)["proof"][key] = value
    path.write_text(json.dumps(data))
    with pytest.raises(FormatError, match=message):
        verify_fold(path, GOAL)


def test_proof_of_the_hold(tmp_path: Path) -> None:
    goal = box_goal()
    proven = prove_net(DualGraph(goal), 0, tree="bfs")
    write_fold(proven.attempt.to_net("exact"), tmp_path / "net.fold")
    assert verify_fold(tmp_path / "net.fold", goal).holds
    data = json.loads((tmp_path / "net.fold").read_text())
    item = certificate_of(data)["proof"]["no_goods"][0]
    item["edges"] = item["edges"][1:]
    (tmp_path / "net.fold").write_text(json.dumps(data))
    check = verify_fold(tmp_path / "net.fold", goal)
    assert "not all sides" in check.problems[0]


def test_the_proof_is_of_this_very_shape(net: Net, tmp_path: Path) -> None:
    write_fold(net, tmp_path / "net.fold")
    other = GoalMesh(GOAL.vertices * np.array([1.0, 1.0, 1.0 + 1e-9]), GOAL.faces)
    with pytest.raises(FormatError, match="another goal mesh"):
        verify_fold(tmp_path / "net.fold", other)
