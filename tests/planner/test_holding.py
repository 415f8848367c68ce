"""Tabs and tethers: on free edges of the base panel, joined to the frame by metal that stays."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from planner.errors import PlanError
from planner.holding import MOST_TABS, TAB_WIDTHS_MM, hold_base
from planner.placement import place_net
from planner.substrate import make_sheet
from tests.planner.hand_nets import cross_net
from tests.planner.hand_plans import LIMITS, some_nets

NETS = {name: place_net(net, LIMITS) for name, net in some_nets().items()}
SHEETS = {name: make_sheet(net, LIMITS) for name, net in NETS.items()}


def random_hits(sheet, share, seed):
    free = np.flatnonzero(~sheet.frame_faces)
    return set(np.random.default_rng(seed).choice(free, int(share * len(free)), replace=False).tolist())


@pytest.mark.parametrize("name", NETS)
def test_tabs_lie_on_cut_edges_of_the_base_panel(name):
    net, hold = NETS[name], hold_base(NETS[name], SHEETS[name], LIMITS, ())
    panel = set(net.base_panel.tolist())
    assert 2 <= len(hold.tabs) <= MOST_TABS
    for tab in hold.tabs:
        assert net.assignment[tab.edge] == "B"
        ends = set(net.edges[tab.edge].tolist())
        assert any(ends <= set(net.faces[f].tolist()) for f in panel)
        edge = shapely.LineString(net.vertices[net.edges[tab.edge]])
        assert max(edge.distance(shapely.Point(p)) for p in (tab.start, tab.end)) < 1e-5
        assert any(math.dist(tab.start, tab.end) == pytest.approx(w, abs=1e-5) for w in TAB_WIDTHS_MM[:3])
    assert hold.needed == hold.clipped == frozenset()


@pytest.mark.parametrize("name", NETS)
@pytest.mark.parametrize("seed", range(4))
def test_the_tether_joins_every_tab_to_the_frame_through_metal_that_stays(name, seed):
    net, sheet = NETS[name], SHEETS[name]
    hits = random_hits(sheet, 0.15, seed)
    hold = hold_base(net, sheet, LIMITS, hits)
    assert hits <= hold.clipped | hold.tether
    if hold.needed:
        assert hold.needed == hold.tether & hits
        return
    assert not hold.tether & hold.clipped
    polygons = shapely.polygons(sheet.triangles)
    stays = sorted(set(range(len(polygons))) - hold.clipped)
    metal = shapely.union_all(polygons[stays], grid_size=1e-6)
    # A neck of a third of a tab is left everywhere: shrink the metal, it must still hang together.
    width = min(math.dist(t.start, t.end) for t in hold.tabs)
    strong = shapely.get_parts(metal.buffer(-width / 6))
    frame = shapely.union_all(polygons[sheet.frame_faces]).buffer(-1.0)
    held = [p for p in strong if p.intersects(frame)]
    for tab in hold.tabs:
        middle = shapely.Point(0.5 * (np.array(tab.start) + np.array(tab.end)))
        assert min(p.distance(middle) for p in held) < LIMITS.kerf + width / 6 + 0.05


@pytest.mark.parametrize("name", NETS)
def test_what_is_left_without_a_way_to_the_frame_is_clipped_too(name):
    """Plain reference: flood over shared edges from the frame."""
    net, sheet = NETS[name], SHEETS[name]
    hits = random_hits(sheet, 0.4, 5)
    hold = hold_base(net, sheet, LIMITS, hits)
    gone = hits - hold.tether
    rows = [set(r) for r in sheet.faces.tolist()]
    reached = set(np.flatnonzero(sheet.frame_faces).tolist())
    grown = True
    while grown:
        grown = {
            t
            for t in set(range(len(rows))) - reached - gone
            if any(len(rows[t] & rows[r]) == 2 for r in reached)
        }
        reached |= grown
    assert hold.clipped >= set(range(len(rows))) - reached
    assert not hold.clipped & set(np.flatnonzero(sheet.frame_faces).tolist())


def test_if_all_is_swept_the_cheapest_way_is_named():
    net, sheet = NETS["strip"], SHEETS["strip"]
    every = set(np.flatnonzero(~sheet.frame_faces).tolist())
    hold = hold_base(net, sheet, LIMITS, every)
    assert hold.needed == hold.tether
    assert 0 < len(hold.needed) < len(every) / 4
    again = hold_base(net, sheet, LIMITS, every - hold.needed)
    assert again.needed == frozenset()  # once that way is kept, the base is held
    assert again.tether <= hold.tether


def test_a_frame_triangle_is_never_clipped_even_if_named():
    net, sheet = NETS["strip"], SHEETS["strip"]
    frame = set(np.flatnonzero(sheet.frame_faces).tolist())
    assert hold_base(net, sheet, LIMITS, frame).clipped == frozenset()


def test_a_base_without_a_free_edge_is_refused_in_words():
    net = place_net(cross_net(base=0), LIMITS)  # four petals around the bottom of the box
    thick = replace(LIMITS, thickness=1.0)  # no neck is wide enough
    with pytest.raises(PlanError, match=r"base face 0 has no free edge.*no corner.*--base"):
        hold_base(net, make_sheet(net, LIMITS), thick, ())


def test_the_same_input_gives_the_same_hold():
    net, sheet = NETS["wedge"], SHEETS["wedge"]
    hits = random_hits(sheet, 0.2, 9)
    assert hold_base(net, sheet, LIMITS, sorted(hits)) == hold_base(net, sheet, LIMITS, sorted(hits)[::-1])
