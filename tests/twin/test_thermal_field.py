"""Heat in the flat net: against formulas, balances of energy, and itself on finer meshes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigs.material import load_material
from tests.twin.thermal_plans import shipped_plan
from twin.cooling import crease_rise, loss_time_s
from twin.errors import HeatingError
from twin.thermal_field import ThermalField
from twin.thermal_mesh import ThermalMesh, plan_mesh, refined

STEEL = load_material("304")
PLATE = np.array([[0, 0], [20, 0], [40, 0], [40, 40], [20, 40], [0, 40.0]])
HALVES = np.array([[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4]])
MIDDLE = (np.array([20.0, 0.0]), np.array([20.0, 40.0]))


def plate(longest: float, clamped: float | None = None, thickness: float = 0.075, **how) -> ThermalField:
    vertices, triangles = refined(PLATE, HALVES, longest)
    held = np.zeros(len(vertices), np.bool_) if clamped is None else vertices[:, 0] < clamped
    mesh = ThermalMesh(vertices, triangles, np.zeros((0, 2), np.int64), np.zeros(0), held)
    return ThermalField(mesh, STEEL, thickness, **how)


def cooled(field: ThermalField, times, joules=0.7, least=0.01):
    line = field.line(*MIDDLE)
    field.deposit(line, joules)
    now, out = 0.0, []
    for time in times:
        steps = math.ceil((time - now) / max(least, 0.02 * now))
        field.advance(time - now, steps)
        now = time
        out.append(field.mean_rise(line))
    return np.array(out)


def test_it_is_the_line_source_in_a_plate():
    """17.5 J/m in 75 um 304: the table of the reference, 26.8, 11.6, 7.8, 5.1, 2.4 and 1.1 K."""
    times = np.array([0.1, 0.5, 1.0, 2.0, 5.0])
    rises = cooled(plate(0.6), times, least=0.0025)
    assert rises == pytest.approx(crease_rise(times, 17.5, 0.075, STEEL), rel=0.025)


def test_it_converges_with_mesh_and_step():
    exact = crease_rise(np.array([1.0]), 17.5, 0.075, STEEL)[0]
    by_mesh = [abs(cooled(plate(side), [1.0], least=0.002)[0] - exact) for side in (4.0, 2.0, 1.0)]
    by_step = [abs(cooled(plate(0.7), [1.0], least=step)[0] - exact) for step in (0.1, 0.05, 0.025)]
    assert by_mesh[0] > by_mesh[1] > by_mesh[2]
    assert by_step[0] > 1.7 * by_step[1] > 2.8 * by_step[2]


def test_no_heat_is_lost_without_losses():
    field = plate(2.0, loss=False)
    cooled(field, [0.3, 5.0, 50.0])
    assert field.energy_j == pytest.approx(0.7, rel=1e-9)
    field.advance(1e5)
    capacity = field.sheet_j_k * 1600.0
    assert field.rise == pytest.approx(np.full(len(field.rise), 0.7 / capacity), rel=1e-3)


def test_what_is_lost_decays_with_the_time_constant():
    field = plate(2.0)
    tau = loss_time_s(STEEL, 0.075)
    assert field.loss_s == tau
    field.deposit(field.line(*MIDDLE), 0.7)
    steps = 400
    field.advance(tau, steps)
    assert field.energy_j == pytest.approx(0.7 * (1.0 + 1.0 / steps) ** -steps, rel=1e-9)


def test_a_plate_that_is_the_same_on_both_sides_stays_so():
    field = plate(1.0)
    cooled(field, [3.0])
    v = field.mesh.vertices
    for far in (3.0, 8.0, 15.0):
        left = field.rise[np.abs(v[:, 0] - (20 - far)) < 1.0].mean()
        right = field.rise[np.abs(v[:, 0] - (20 + far)) < 1.0].mean()
        assert left == pytest.approx(right, rel=0.02)
    assert field.rise.min() > -0.02 * field.rise.max()


def test_a_clamp_takes_heat_and_stays_cold():
    free, held = plate(1.0, loss=False), plate(1.0, clamped=10.0, loss=False)
    for field in (free, held):
        cooled(field, [20.0])
    assert held.energy_j < free.energy_j
    assert (held.rise[held.mesh.clamped] == 0.0).all()


def test_tabs_lead_heat_into_the_sheet():
    plan = shipped_plan("crown")
    mesh = plan_mesh(plan, 3.0)
    closed = ThermalMesh(mesh.vertices, mesh.triangles, mesh.links[:0], mesh.link_ratio[:0], mesh.clamped)
    left = []
    for each in (mesh, closed):
        field = ThermalField(each, STEEL, 0.1, loss=False)
        face = next(f for f in plan.net.child_of.values() if plan.net.parent[f] == plan.net.base_face)
        field.deposit(field.line(*plan.net.hinge(face)), 1.0)
        field.advance(60.0, 120)
        assert field.rise.min() > -1e-9
        left.append(field.energy_j)
    assert left[1] == pytest.approx(1.0, rel=1e-9)
    assert left[0] < 0.999


def test_no_thickness_is_refused():
    with pytest.raises(HeatingError, match="thickness 0 mm"):
        plate(5.0, thickness=0.0)
