"""From a net to the net of fewest edits around the same base face, with a proof of how few there can be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import cast

from planner.blooming_trees import BLOOMING_TREES, TreeName
from planner.dual_graph import DualGraph
from planner.fewest_edits import prove_net
from planner.net import Net

__all__ = ["prove_edits"]


def prove_edits(
    net: Net,
    *,
    seed: int = 0,
    seconds: float = 30.0,
    progress: Callable[[int, int, float], None] | None = None,
) -> Net:
    """A net with at most as many edits as ``net``, and a proof of a lower bound in its certificate.

    What is proven holds for the base face of ``net`` and for the blooming tree that its certificate names
    (``steepest`` if it names none), see ``planner.fewest_edits.prove_net``.

    Args:
        net: a net without overlap.
        seed: of every random choice.
        seconds: wall-clock limit. Where it ends the search, the result depends on the machine.
        progress: called with (edits, bound, seconds).
    """
    certificate = net.certificate
    blooming = certificate.tree in BLOOMING_TREES
    tree = cast(TreeName, certificate.tree) if blooming else "steepest"
    found = prove_net(
        DualGraph(net.goal), net.base_face, tree=tree, seed=seed, seconds=seconds, progress=progress
    )
    if found.attempt.is_net and (not blooming or found.attempt.edits <= certificate.edits):
        proven = found.attempt.to_net("exact")
        bases = tuple(
            replace(trial, edits=proven.certificate.edits) if trial.face == proven.base_face else trial
            for trial in certificate.bases
        )
        return replace(proven, certificate=replace(proven.certificate, bases=bases))
    if not blooming:
        return net
    certificate = replace(
        certificate,
        lower_bound=found.lower_bound,
        optimal=certificate.edits == found.lower_bound,
        proof=found.proof,
    )
    return replace(net, certificate=certificate)
