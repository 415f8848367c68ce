"""Ways through the sheet: wide enough everywhere, also where metal is narrow beside a long side."""

from __future__ import annotations

import numpy as np
import pytest

from planner.fold_plan import Sheet
from planner.substrate_ways import LEAST_WAY_MM, SubstrateGraph


def pinched(gap_mm: float) -> SubstrateGraph:
    """A frame triangle (2) and a free one (0), joined past a corner that stands ``gap_mm`` over an edge."""
    vertices = [(-5.0, 0.0), (5.0, 0.0), (0.0, gap_mm), (-5.0, 6.0), (5.0, 6.0)]
    return SubstrateGraph(
        Sheet(
            outline=np.array([(-5.0, 0.0), (5.0, 0.0), (5.0, 6.0), (-5.0, 6.0)]),
            vertices=np.array(vertices), faces=np.array([(0, 2, 3), (0, 1, 2), (1, 4, 2)]),
            frame_faces=np.array([False, False, True]), tabs=(),
            rotary_axis=np.array([(-9.0, 0.0), (9.0, 0.0)]),
        )
    )  # fmt: skip


@pytest.mark.parametrize("neck_mm", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("gap_mm", [0.01, 0.25, 0.4, 1.0, 3.0])
def test_a_way_past_a_corner_is_as_wide_as_the_metal_there(gap_mm, neck_mm):
    ways = pinched(gap_mm).ways(neck_mm, frozenset())
    assert 1 in ways.cost  # the side to the frame is long
    assert (0 in ways.cost) == (gap_mm >= max(neck_mm, LEAST_WAY_MM))


def test_metal_beyond_the_third_side_makes_room_unless_it_is_swept():
    graph = pinched(0.05)
    sheet = graph.sheet
    wider = SubstrateGraph(
        Sheet(
            outline=np.array([(-5.0, -6.0), (5.0, -6.0), (5.0, 6.0), (-5.0, 6.0)]),
            vertices=np.vstack([sheet.vertices, [(0.0, -6.0)]]), faces=np.vstack([sheet.faces, [(0, 5, 1)]]),
            frame_faces=np.append(sheet.frame_faces, False), tabs=(), rotary_axis=sheet.rotary_axis,
        )
    )  # fmt: skip
    assert 0 in wider.ways(1.0, frozenset()).cost
    assert 0 not in wider.ways(1.0, frozenset({3})).cost
