"""Checks a net and the proof of its certificate with plain geometry and whole numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.blooming_trees import BLOOMING_TREES, blooming_tree
from planner.corner_tabs import CORNER_WIDTHS_MM, corner_tabs
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.flat_layout import base_outline
from planner.fold_plan import MachineLimits
from planner.net import Net
from planner.net_proof import NetProof, ProofCheck, ProofNoGood
from planner.no_goods import never_free
from planner.proof_geometry import PROVEN_DEPTH_MM, FaceShapes, Triangle, penetration, vertex_fan
from planner.tree_bound import TreeBound

__all__ = ["check_net", "check_proof"]

NET_DEPTH_MM = 1e-4 * (1.0 + 1e-3)
"""Faces of a net may penetrate each other by the tolerance of the nets, and by rounding."""


def check_net(net: Net) -> ProofCheck:
    """Count the edits afresh, look for overlaps, check the proof and what the certificate says about it."""
    graph = DualGraph(net.goal)
    certificate = net.certificate
    problems = [f"faces {a} and {b} of the net overlap" for a, b in net_overlaps(net)[:3]]
    tree = tree_of(net, graph)
    if certificate.tree not in BLOOMING_TREES:
        if certificate.lower_bound or certificate.optimal or certificate.proof is not None:
            problems.append(f"{certificate.tree!r} is no blooming tree, so there is nothing to be proven")
        return ProofCheck(certificate.edits, 0, False, 0, tuple(problems))
    blooming = blooming_tree(graph, net.base_face, certificate.tree)
    edits = int(np.count_nonzero(tree & ~blooming))
    if edits != certificate.edits:
        problems.append(f"the certificate says {certificate.edits} edits, the net has {edits}")
    outline = base_outline(graph, np.isin(np.arange(len(net.parent)), net.base_panel))
    cramped = not any(side < 0 or not tree[side] for side in outline[:, 2].tolist())
    necks = corner_tabs(net, MachineLimits(), CORNER_WIDTHS_MM[0]) if cramped else []
    if cramped and not (necks and never_free(graph, net.base_face)):
        problems.append("every side of the base panel that could hold a tab is a crease")
    proven, shown = 0, 0
    proof = certificate.proof
    if proof is not None:
        proven, shown, wrong = check_proof(graph, net.base_face, blooming, proof)
        problems += wrong
        if proof.whole_panels and not tree[graph.flat_forest].all():
            problems.append("the proof is for nets with whole flat panels, but this net cuts one")
    if certificate.lower_bound > proven:
        problems.append(
            f"the certificate says that {certificate.lower_bound} edits are needed, but shown is {proven}"
        )
    if certificate.optimal and proven < edits:
        problems.append(f"the certificate says optimal, but {edits} edits are more than the bound {proven}")
    return ProofCheck(edits, proven, proven >= edits and not problems, shown, tuple(problems))


def check_proof(
    graph: DualGraph, base: int, blooming: NDArray[np.bool_], proof: NetProof
) -> tuple[int, int, list[str]]:
    """The bound that a proof shows (0 if it is wrong), how many no-goods hold, and what is wrong.

    Args:
        graph: the dual graph of the goal.
        base: the base face.
        blooming: (M,) the blooming tree.
        proof: the proof.
    """
    number = {(a, b): e for e, (a, b) in enumerate(graph.vertices.tolist())}
    problems = []
    shapes = FaceShapes(graph.goal)
    for place, item in enumerate(proof.no_goods):
        fault = no_good_fault(graph, shapes, base, item, number)
        if fault:
            problems.append(f"no-good {place} does not hold: {fault}")
    holding = len(proof.no_goods) - len(problems)
    if not problems:
        problems += _structure_faults(proof, number)
    if problems:
        return 0, holding, problems
    kept = graph.flat_forest & (proof.whole_panels | (graph.panel[graph.faces[:, 0]] == graph.panel[base]))
    bound = TreeBound(
        len(graph.goal.faces), graph.faces.tolist(), blooming.tolist(), kept.tolist(), proof.denominator
    )
    no_goods = [(tuple(number[edge] for edge in item.edges), item.cut_at_least) for item in proof.no_goods]
    shown: int | None = None
    todo: list[tuple[int, dict[int, bool]]] = [(0, {})]
    while todo:
        at, fixed = todo.pop()
        node = proof.branches[at]
        if node.edge is not None:
            edge = number[node.edge]
            for case, keep in zip(node.cases, (True, False), strict=True):
                if fixed.get(edge, keep) == keep:
                    todo.append((case, {**fixed, edge: keep}))
            continue
        rows = proof.multipliers[node.multipliers]
        value = bound.edits([(*no_goods[item], times) for item, times in rows], fixed)
        if value is not None:
            shown = value if shown is None else min(shown, value)
    if shown is None:
        return 0, holding, ["every case of the proof is empty, so there would be no spanning tree at all"]
    if shown < proof.bound:
        problems.append(f"the proof claims {proof.bound} edits, but its cases show {shown}")
    return min(shown, proof.bound), holding, problems


def no_good_fault(
    graph: DualGraph,
    shapes: FaceShapes,
    base: int,
    item: ProofNoGood,
    number: dict[tuple[int, int], int],
) -> str:
    """Why a no-good does not hold; "" if it does."""
    if any(edge not in number for edge in item.edges) or len(set(item.edges)) != len(item.edges):
        return "it names an edge twice, or one that is no inner edge of the goal"
    if item.why == "hold":
        sides = base_outline(graph, graph.panel == graph.panel[base])[:, 2]
        outline = {number[edge] for edge in item.edges} >= set(sides.tolist())
        outline = outline and not never_free(graph, base)
        return "" if outline and item.cut_at_least <= 1 else "these are not all sides that could hold a tab"
    if item.why == "vertex":
        return _vertex_fault(graph, shapes, item)
    count = len(graph.goal.faces)
    first, last = item.faces
    if item.cut_at_least > 1 or not (0 <= first < count and 0 <= last < count):
        return "a path shows that one edge is cut, not more, and joins two faces of the goal"
    try:
        laid = shapes.path(first, item.edges)
    except ValueError as error:
        return str(error)
    if laid[-1][0] != last or len({face for face, _ in laid}) != len(laid):
        return f"the path does not lead from face {first} to face {last}, each face once"
    depth = penetration(laid[0][1], laid[-1][1])
    return "" if depth > PROVEN_DEPTH_MM else f"faces {first} and {last} do not overlap along the path"


def _vertex_fault(graph: DualGraph, shapes: FaceShapes, item: ProofNoGood) -> str:
    """Why a no-good around a vertex does not hold."""
    vertex = item.faces[0]
    fan = vertex_fan(graph.goal, vertex) if vertex < len(graph.goal.vertices) else None
    if fan is None:
        return f"vertex {vertex} is not inside the goal"
    spokes = {(min(vertex, w), max(vertex, w)) for _, w in fan}
    if set(item.edges) != spokes or item.cut_at_least > 2:
        return f"these are not the edges around vertex {vertex}, or more than two shall be cut"
    if not shapes.every_cut_overlaps(vertex, fan):
        return f"around vertex {vertex} one cut is enough"
    return ""


def _structure_faults(proof: NetProof, number: dict[tuple[int, int], int]) -> list[str]:
    """What is wrong with the numbers of a proof."""
    if proof.denominator < 1 or not proof.branches:
        return ["the proof has no denominator or no branches"]
    for row in proof.multipliers:
        if any(not 0 <= item < len(proof.no_goods) or times < 0 for item, times in row):
            return ["a multiplier is negative or belongs to no no-good"]
    used = [0] * len(proof.branches)
    for at, node in enumerate(proof.branches):
        if node.edge is None:
            if not 0 <= node.multipliers < len(proof.multipliers):
                return [f"branch {at} names multipliers that are not there"]
            continue
        if node.edge not in number:
            return [f"branch {at} is on {node.edge}, which is no inner edge of the goal"]
        for case in node.cases:
            if not at < case < len(proof.branches):
                return [f"branch {at} lacks a case"]
            used[case] += 1
    if used[0] or any(times != 1 for times in used[1:]):
        return ["the branches are not one tree"]
    return []


def tree_of(net: Net, graph: DualGraph) -> NDArray[np.bool_]:
    """(M,) interior edges of the goal that are creases or flat joints of the net."""
    tree = np.zeros(len(graph.faces), dtype=np.bool_)
    flat, solid = net.faces.tolist(), net.goal.faces.tolist()
    edge_of = {(a, b): e for e, (a, b) in enumerate(graph.vertices.tolist())}
    for face, crease in enumerate(net.crease_of.tolist()):
        if crease < 0:
            continue
        ends = set(net.edges[crease].tolist())
        k = next((k for k in range(3) if {flat[face][k], flat[face][(k + 1) % 3]} == ends), None)
        if k is None:
            raise NetError(f"face {face} does not have its crease among its sides; make the net again")
        a, b = solid[face][k], solid[face][(k + 1) % 3]
        tree[edge_of[min(a, b), max(a, b)]] = True
    return tree


def net_overlaps(net: Net) -> list[tuple[int, int]]:
    """Pairs of faces of the net that overlap, by comparing all whose bounding boxes meet."""
    corners = net.vertices[net.faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    places = (corners[..., 0] + 1j * corners[..., 1]).tolist()
    triangles: list[Triangle] = [(row[0], row[1], row[2]) for row in places]
    found = []
    for face in range(len(corners)):
        meets = (low[face + 1 :] < high[face]).all(axis=1) & (high[face + 1 :] > low[face]).all(axis=1)
        others = (face + 1 + np.flatnonzero(meets)).tolist()
        found += [(face, g) for g in others if penetration(triangles[face], triangles[g]) > NET_DEPTH_MM]
    return found
