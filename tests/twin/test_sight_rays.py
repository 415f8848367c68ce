"""The beam's view of a crease against plain geometry: every ray, every middle surface."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from planner.beam import to_light
from planner.fold_plan import MachineLimits
from tests.twin.hand_plans import breadth_first_net, icosahedron, plan_of, ring_sheet
from twin.loaded_model import LoadedModel
from twin.mjcf_model import compile_model
from twin.sight_rays import BeamView
from twin.timeline import Turn, turns

LIFT_MM = 0.02
SHARES = np.linspace(0.02, 0.98, 21)


def through(start, direction, a, b, c) -> bool:
    """Möller and Trumbore: does the ray meet the triangle, from a little behind its start on?"""
    first, second = b - a, c - a
    across = np.cross(direction, second)
    scale = float(first @ across)
    if scale == 0.0:
        return False
    offset = start - a
    u = float(offset @ across) / scale
    v = float(direction @ np.cross(offset, first)) / scale
    along = float(second @ np.cross(offset, first)) / scale
    return u >= 0.0 and v >= 0.0 and u + v <= 1.0 and along >= -LIFT_MM


def plain(loaded: LoadedModel, turn: Turn, limits: MachineLimits) -> list[set[tuple[str, int]]]:
    """What is over each point of the crease."""
    side, net, data = loaded.compiled.side, loaded.net, loaded.data
    child = net.child_of[turn.crease]
    own = {side.panel_of[child], side.panel_of[net.parent[child]]}
    middles = {
        owner: (c := loaded.corners(np.array([geom]))[0])[: len(c) // 2] / 2 + c[len(c) // 2 :] / 2
        for geom, owner in loaded.owner.items()
        if not (owner[0] == "face" and side.panel_of[owner[1]] in own)
        and not (owner[0] == "sheet" and turn.gone[owner[1]])
    }
    joint = loaded.joint[turn.joint]
    start, end = net.hinge(child)
    along = data.xaxis[joint] * np.linalg.norm(end - start)
    over = []
    for share in SHARES:
        point = data.xanchor[joint] + share * along
        light = to_light(turn.rotary_rad, point, limits)
        over.append(
            {
                owner
                for owner, m in middles.items()
                if any(
                    through(point + LIFT_MM * light, light, m[0], m[k], m[k + 1])
                    for k in range(1, len(m) - 1)
                )
            }
        )
    return over


def posed(source=None) -> tuple[LoadedModel, list[Turn], MachineLimits]:
    """An icosahedron's net in its sheet, and its turns; ``pose`` puts it anyhow."""
    net = breadth_first_net(icosahedron())
    limits = MachineLimits(beam_source=source)
    plan = plan_of(net, sheet=ring_sheet(net, gap=0.5, margin=30.0), limits=limits)
    compiled = compile_model(plan)
    return LoadedModel(compiled, net), [t for t in turns(plan, compiled.side) if t.crease >= 0], limits


def pose(loaded: LoadedModel, every: list[Turn], rng: np.random.Generator) -> None:
    for turn in every:
        loaded.set_angle(turn.joint, rng.uniform(-2.0, 2.0))
    mujoco.mj_kinematics(loaded.model, loaded.data)


def low_light(rng: np.random.Generator) -> float:
    """A rotary angle at which the light comes so low that the sheet is often in its way."""
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(1.1, 2.0))


@pytest.mark.parametrize("source", [None, (5.0, -3.0, 80.0)])
def test_the_view_is_that_of_plain_geometry(source) -> None:
    rng = np.random.default_rng(5)
    loaded, every, limits = posed(source)
    seen = {"face": 0, "sheet": 0}
    for _ in range(4):
        pose(loaded, every, rng)
        for turn in every[::2]:
            gone = rng.random(len(turn.gone)) < 0.3
            turned = replace(turn, rotary_rad=low_light(rng), gone=gone)
            over = plain(loaded, turned, limits)
            hidden = BeamView(loaded, turned, limits).hidden()
            assert hidden.share == sum(map(bool, over)) / len(over)
            named = {("face", f) for f in hidden.faces} | {("sheet", k) for k in hidden.pieces}
            assert named <= set().union(*over)
            assert all(named & what for what in over if what)
            for kind, _ in named:
                seen[kind] += 1
    assert seen["face"] > 20 and seen["sheet"] > 0


def test_sheet_that_was_clipped_before_a_turn_hides_nothing_of_it() -> None:
    """Also at the first look at a turn, when contacts are still set for the turn before the clip."""
    rng = np.random.default_rng(1)
    loaded, every, limits = posed()
    hiding = 0
    for _ in range(20):
        pose(loaded, every, rng)
        turn = replace(every[0], rotary_rad=low_light(rng))
        loaded.all_contacts_on(turn.gone)
        pieces = BeamView(loaded, turn, limits).hidden().pieces
        hiding += bool(pieces)
        gone = turn.gone.copy()
        gone[list(pieces)] = True
        assert not set(BeamView(loaded, replace(turn, gone=gone), limits).hidden().pieces) & set(pieces)
    assert hiding > 3
