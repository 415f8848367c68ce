"""The finite-element benchmark: mesh, heat input, decks and reading; a short run where CalculiX is there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks import calculix
from benchmarks.calculix_deck import (
    LENGTH_RADII,
    WIDTH_RADII,
    Pass,
    beam_times,
    flange_places,
    foil_mesh,
    hat_shares,
    heat_deck,
    stress_deck,
)
from benchmarks.calculix_run import CalculixError, _blocks, available, bent
from rigs.material import load_material

CASE = Pass("t", "304", 20.0, 400.0, 0.06, 0.075)
STEEL = load_material("304")


def test_the_mesh_is_a_box_of_positive_bricks():
    mesh = foil_mesh(CASE)
    points = mesh.points
    assert points.min() == 0.0
    np.testing.assert_allclose(points.max(axis=0), [LENGTH_RADII * 0.06, WIDTH_RADII * 0.06, 0.075])
    corners = points[mesh.bricks - 1]
    edges = corners[:, [1, 3, 4]] - corners[:, [0]]
    volume = np.linalg.det(edges)
    assert volume.min() > 0.0
    assert volume.sum() == pytest.approx(math.prod(points.max(axis=0)))
    assert np.all(np.diff(mesh.y, 2) > 0.0)  # wider and wider away from the crease


@pytest.mark.parametrize("centre", [0.0, 0.3, 0.41])
def test_all_heat_of_a_spot_goes_to_nodes_at_its_place(centre):
    places = np.linspace(-0.2, 0.8, 41)
    shares = hat_shares(places, centre, 0.06)
    assert shares.sum() == pytest.approx(1.0, abs=1e-6)
    assert shares @ places == pytest.approx(centre, abs=1e-6)
    assert hat_shares(np.linspace(0.0, 1.0, 41), 0.0, 0.06).sum() == pytest.approx(0.5, abs=1e-6)


def test_the_heat_that_goes_in_is_the_energy_of_the_pass():
    mesh = foil_mesh(CASE)
    step, count = beam_times(CASE)
    first = -3.0 * CASE.radius_mm
    joules = sum(
        step * hat_shares(mesh.x, first + CASE.speed_mm_s * step * n, CASE.radius_mm).sum()
        for n in range(1, count + 1)
    )
    assert joules == pytest.approx(mesh.x[-1] / CASE.speed_mm_s, rel=1e-3)


def test_decks_name_every_node_and_the_materials_own_figures():
    mesh = foil_mesh(CASE, 0.4)
    heat = heat_deck(CASE, mesh, STEEL)
    assert heat.count("\n*AMPLITUDE") == len(mesh.x) == heat.count("\n*CFLUX, AMPLITUDE")
    for row in zip(STEEL.table.conductivity_w_mk, STEEL.table.temperature_c, strict=True):
        assert "{:g},{:g}".format(*row) in heat
    cold = np.full(len(mesh.points), 20.0)
    stress = stress_deck(mesh, STEEL, [cold, cold + 100.0], 200.0)
    assert stress.count("*STATIC") == 3  # cold again at the end
    assert "265,0,20" in stress and "C3D8I" in stress
    near, far = flange_places(mesh)
    assert 0 < near < far == len(mesh.y) - 1


def test_results_that_end_too_early_are_no_results(tmp_path):
    path = tmp_path / "heat.dat"
    path.write_text("\n temperatures for set NALL and time  0.1\n\n 1 20.5\n 2 21.5\n\n 1 3e1\n 2 4e1\n")
    blocks = list(_blocks(path, 2))
    np.testing.assert_allclose(blocks, [[[20.5], [21.5]], [[30.0], [40.0]]])
    path.write_text(" 1 20.5\n 2 21.5\n 1 3e1\n")
    with pytest.raises(CalculixError, match="middle of a table"):
        list(_blocks(path, 2))


def test_without_the_program_it_says_so(monkeypatch, capsys):
    monkeypatch.setattr(calculix, "available", lambda: False)
    monkeypatch.setattr("sys.argv", ["calculix"])
    assert calculix.main() == 0
    assert "not installed: nothing was run" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(not available(), reason="CalculiX (ccx) is not installed")
def test_a_coarse_run_folds_towards_the_laser(tmp_path):
    found = bent(CASE, STEEL, tmp_path, 200.0, finer=0.5)
    assert 0.5 < found.angle_deg < 2.5 and found.peak_bottom_c < found.peak_top_c < 1600.0
