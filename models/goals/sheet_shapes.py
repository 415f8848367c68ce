"""Open shapes: flat patterns of panels, folded. Sizes in mm before scaling, angles in degrees."""

from __future__ import annotations

import numpy as np

from models.goals.folded_panels import Mesh, PanelModel

__all__ = ["antenna", "box_with_lid", "bracket", "bug_robot", "crown", "drone_frame", "flower"]


def bracket() -> Mesh:
    """A mounting bracket: base, upright with a lip, a gusset on one side and a stiffener on the other."""
    model = PanelModel([(0, 0), (60, 0), (60, 24), (0, 24)])
    upright = model.attach(0, 1, [(0, 34), (24, 34)], 90.0)
    model.attach(upright, 2, [(3, 9), (21, 9)], -90.0)
    model.attach(0, 0, [(22, 6), (55, 20)], 90.0)
    model.attach(0, 2, [(4, 8), (56, 8)], -90.0)
    return model.mesh()


def box_with_lid() -> Mesh:
    """A box whose lid stands open by 30 degrees, with a tuck flap; its walls meet at the corners."""
    model = PanelModel([(0, 0), (44, 0), (44, 30), (0, 30)])
    height = 20.0
    walls = [
        model.attach(0, edge, [(0, height), (width, height)], -90.0)
        for edge, width in enumerate((44.0, 30.0, 44.0, 30.0))
    ]
    lid = model.attach(walls[2], 2, [(0, 30), (44, 30)], -60.0)
    model.attach(lid, 2, [(2, 8), (42, 8)], -60.0)
    return model.mesh(turned_deg=180.0)


def crown(points: int = 10) -> Mesh:
    """A closed band with high and low points in turn, both leaning outwards."""
    width, height = 12.0, 14.0
    model = PanelModel([(0, 0), (width, 0), (width, height), (0, height)])
    panels, panel, edge = [0], 0, 1
    for _ in range(points - 1):
        panel = model.attach(panel, edge, [(0, width), (height, width)], -360.0 / points)
        panels.append(panel)
        edge = 2
    for number, panel in enumerate(panels):
        high = number % 2 == 0
        top = 2 if number == 0 else 3  # a panel's first edge is its hinge, except for the first panel
        model.attach(panel, top, [(width / 2, 14.0 if high else 8.0)], 15.0 if high else 25.0)
    return model.mesh(turned_deg=90.0)


def flower(petals: int = 6) -> Mesh:
    """A regular polygon with petals that rise, level out and droop at the tip."""
    angles = np.arange(petals) * 2.0 * np.pi / petals
    radius = 10.0
    model = PanelModel([(radius * np.cos(a), radius * np.sin(a)) for a in angles])
    width = model.edge_length_mm(0, 0)
    for edge in range(petals):
        stem = model.attach(0, edge, [(-4, 12), (width + 4, 12)], 40.0)
        blade_width = width + 8
        blade = model.attach(stem, 2, [(-1, 6), (3, 14), (blade_width - 3, 14), (blade_width + 1, 6)], -25.0)
        model.attach(blade, 3, [((blade_width - 6) / 2, 8)], -40.0)
    return model.mesh()


def antenna(segments: int = 11) -> Mesh:
    """A straight strip with slanting creases that winds itself into a square helix on a square foot."""
    side, rise, width = 16.0, 5.0, 7.0
    model = PanelModel([(0, 0), (side, 0), (side, 4), (side, 4 + width), (0, 4 + width - rise)])
    model.attach(0, 0, [(0, side), (side, side)], -90.0)
    panel = 0
    for _ in range(segments):
        panel = model.attach(panel, 2, [(rise, side), (rise + width, side)], -90.0)
    return model.mesh(turned_deg=90.0)


def drone_frame(arms: int = 4) -> Mesh:
    """A frame for a small drone: plate, stiffened arms, motor pads and landing legs with feet."""
    long_edge, short_edge = 14.0, 7.0
    outline, heading = [(0.0, 0.0)], 0.0
    for k in range(2 * arms - 1):
        length = long_edge if k % 2 == 0 else short_edge
        x, y = outline[-1]
        outline.append((x + length * np.cos(heading), y + length * np.sin(heading)))
        heading += np.pi / arms
    model = PanelModel(outline)
    for arm_number in range(arms):
        arm = model.attach(0, 2 * arm_number, [(3, 16), (11, 16)], 8.0)
        for edge in (1, 3):
            length = model.edge_length_mm(arm, edge)
            model.attach(arm, edge, [(2, 3.5), (length - 2, 3.5)], -80.0)
        pad = model.attach(arm, 2, [(-3, 4), (-3, 9), (0, 12), (8, 12), (11, 9), (11, 4)], -8.0)
        leg = model.attach(pad, 4, [(2, 13), (6, 13)], -100.0)
        model.attach(leg, 2, [(0, 4), (4, 4)], 75.0)
    return model.mesh()


def bug_robot() -> Mesh:
    """A six-legged robot: body, three-part legs with feet, head with feelers, tail with a sting."""
    model = PanelModel([(-18, -10), (-6, -12), (6, -12), (18, -10), (18, 10), (6, 12), (-6, 12), (-18, 10)])
    for edge in (0, 1, 2, 4, 5, 6):
        width = model.edge_length_mm(0, edge)
        inset = (width - 6) / 2
        hip = model.attach(0, edge, [(inset, 8), (inset + 6, 8)], 30.0)
        thigh = model.attach(hip, 2, [(1, 12), (5, 12)], -75.0)
        shin = model.attach(thigh, 2, [(1, 11), (3, 11)], -35.0)
        model.attach(shin, 2, [(-1, 4), (3, 4)], 80.0)
    head = model.attach(0, 3, [(3, 8), (6, 13), (14, 13), (17, 8)], -20.0)
    model.attach(head, 2, [(0.5, 15), (2.5, 15)], 50.0)
    model.attach(head, 4, [(3.3, 15), (5.3, 15)], 50.0)
    model.attach(head, 3, [(2, 5), (6, 5)], -50.0)
    tail = model.attach(0, 7, [(2, 10), (8, 16), (12, 16), (18, 10)], 25.0)
    model.attach(tail, 3, [(2, 9)], 45.0)
    return model.mesh()
