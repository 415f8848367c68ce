"""The proof that every net of a base face and a blooming tree needs at least so many edits."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from planner.goal_mesh import GoalMesh

__all__ = ["NetProof", "ProofBranch", "ProofCheck", "ProofNoGood", "Reason", "verify_fold"]

Reason = Literal["overlap", "vertex", "hold"]


@dataclass(frozen=True)
class ProofNoGood:
    """Of the goal edges ``edges`` every net cuts at least ``cut_at_least``.

    Attributes:
        edges: goal vertices (v, w), v < w, of each edge; for ``overlap`` in order from ``faces[0]`` on.
        cut_at_least: how many.
        why: ``overlap`` (the faces at the ends of the path overlap), ``vertex`` (around this vertex the faces
            overlap whichever single edge is cut) or ``hold`` (the base panel needs a free side).
        faces: the faces that overlap; the vertex twice; or the base face twice.
    """

    edges: tuple[tuple[int, int], ...]
    cut_at_least: int
    why: Reason
    faces: tuple[int, int]


@dataclass(frozen=True)
class ProofBranch:
    """A node of the proof: either a case distinction on an edge, or a bound by multipliers.

    Attributes:
        edge: goal vertices of the edge that is a crease in the first case and cut in the second; None for a
            bound.
        cases: numbers of the two nodes, both higher than this one's.
        multipliers: place in ``NetProof.multipliers``, -1 for a case distinction.
    """

    edge: tuple[int, int] | None = None
    cases: tuple[int, int] = (-1, -1)
    multipliers: int = -1


@dataclass(frozen=True)
class NetProof:
    """A lower bound of the edits of every net, that can be checked without the solver that found it.

    Attributes:
        no_goods: what every net cuts.
        denominator: of all multipliers.
        multipliers: for each bound the no-goods used and their multipliers times ``denominator``.
        branches: the case distinctions, the first node is the root.
        bound: fewest edits that every node without cases grants.
        whole_panels: whether the bound is for nets that cut no flat joint; else only the base panel is whole.
    """

    no_goods: tuple[ProofNoGood, ...]
    denominator: int
    multipliers: tuple[tuple[tuple[int, int], ...], ...]
    branches: tuple[ProofBranch, ...]
    bound: int
    whole_panels: bool = True

    def to_json(self) -> dict[str, Any]:
        """As it stands in ``net.fold``."""
        return {
            "bound": self.bound,
            "whole_panels": self.whole_panels,
            "denominator": self.denominator,
            "no_goods": [
                {
                    "edges": [list(edge) for edge in item.edges],
                    "cut_at_least": item.cut_at_least,
                    "why": item.why,
                    "faces": list(item.faces),
                }
                for item in self.no_goods
            ],
            "multipliers": [[list(pair) for pair in row] for row in self.multipliers],
            "branches": [
                {"multipliers": node.multipliers}
                if node.edge is None
                else {"edge": list(node.edge), "kept": node.cases[0], "cut": node.cases[1]}
                for node in self.branches
            ],
        }

    @classmethod
    def from_json(cls, data: object) -> NetProof:
        """From ``net.fold``.

        Raises:
            ValueError: if it does not have this form; the message says what is wrong.
        """
        found = _table(data, "the proof")
        no_goods = []
        for item in _rows(found, "no_goods"):
            row = _table(item, "a no-good")
            why = row.get("why")
            if why not in ("overlap", "vertex", "hold"):
                raise ValueError(f"a no-good has the reason {why!r}, expected overlap, vertex or hold")
            faces = _numbers(row.get("faces"), 2)
            edges = tuple(_edge(edge) for edge in _rows(row, "edges"))
            no_goods.append(ProofNoGood(edges, _number(row, "cut_at_least"), why, (faces[0], faces[1])))
        branches = []
        for item in _rows(found, "branches"):
            row = _table(item, "a branch")
            if "edge" in row:
                cases = (_number(row, "kept"), _number(row, "cut"))
                branches.append(ProofBranch(_edge(row["edge"]), cases))
            else:
                branches.append(ProofBranch(multipliers=_number(row, "multipliers")))
        multipliers = []
        for row in _rows(found, "multipliers"):
            if not isinstance(row, list):
                raise ValueError("multipliers are lists of pairs")
            pairs = [_numbers(pair, 2) for pair in row]
            multipliers.append(tuple((pair[0], pair[1]) for pair in pairs))
        whole = found.get("whole_panels", True)
        if not isinstance(whole, bool):
            raise ValueError("whole_panels is true or false")
        return cls(
            tuple(no_goods), _number(found, "denominator"), tuple(multipliers), tuple(branches),
            _number(found, "bound"), whole,
        )  # fmt: skip


@dataclass(frozen=True)
class ProofCheck:
    """What checking a net and its proof found.

    Attributes:
        edits: creases of the net that the blooming tree does not have, counted afresh.
        lower_bound: edits that the proof shows to be needed; 0 without a proof that holds.
        optimal: the net needs no more than that.
        no_goods: how many no-goods were laid out and found true.
        problems: what does not hold, in words.
    """

    edits: int
    lower_bound: int
    optimal: bool
    no_goods: int
    problems: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """True if the net and all that its certificate claims were confirmed."""
        return not self.problems


def verify_fold(path: str | os.PathLike[str], goal: GoalMesh) -> ProofCheck:
    """Check the net of a FOLD file and its certificate afresh, without the solver that made them.

    The blooming tree and the edits are counted again, the net is tested for overlap, every no-good is laid
    out, and the bound is computed in whole numbers: geometry in plain Python, and one minimum spanning tree
    for each bound of the proof.

    Args:
        path: the file.
        goal: the goal mesh that it was made from.

    Raises:
        FormatError: if the file is not a net of this goal.
        OSError: if it cannot be read.
    """
    from planner.fold_file import read_fold
    from planner.proof_check import check_net

    return check_net(read_fold(path, goal))


def _table(data: object, what: str) -> Mapping[str, Any]:
    if not isinstance(data, dict):
        raise ValueError(f"{what} is an object, got {data!r:.40}")
    return data


def _rows(data: Mapping[str, Any], key: str) -> list[Any]:
    rows = data.get(key)
    if not isinstance(rows, list):
        raise ValueError(f"{key} is missing or not a list")
    return rows


def _number(data: Mapping[str, Any], key: str) -> int:
    value = data.get(key)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ValueError(f"{key} is a whole number from 0 on, got {value!r:.40}")
    return value


def _numbers(row: object, count: int) -> list[int]:
    if not isinstance(row, list) or len(row) != count:
        raise ValueError(f"expected {count} numbers, got {row!r:.40}")
    return [_number({"an entry": value}, "an entry") for value in row]


def _edge(row: object) -> tuple[int, int]:
    pair = _numbers(row, 2)
    return pair[0], pair[1]
