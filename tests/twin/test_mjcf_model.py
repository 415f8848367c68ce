"""The compiled model: loads by itself, folds as the planner does, has the right masses and filters."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from importlib import resources
from pathlib import Path

import mujoco
import numpy as np
import pytest

from planner.fold_plan import Bend, Clip, MachineLimits, Rotate, Tab
from planner.goal_mesh import GoalMesh
from planner.insets import prism_corners
from planner.kinematics import folded_triangles
from tests.twin.hand_plans import box, breadth_first_net, icosahedron, plan_of, ring_sheet, star
from twin.errors import ModelError
from twin.hinge_law import STEEL_304, SheetMetal, hinge_law
from twin.loaded_model import LoadedModel, quiet_mujoco
from twin.mjcf_model import DEEPEST_NESTING, compile_model
from twin.scenery import SCENERY_PARTS
from twin.timeline import beam_direction, turns

GOALS = [box(), box(60, 2, 2), star(), icosahedron(), icosahedron(30, 1)]


def world_corners(loaded: LoadedModel, face: int) -> np.ndarray:
    model, data = loaded.model, loaded.data
    geom = loaded.face_geom[face]
    mesh = model.geom_dataid[geom]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    local = model.mesh_vert[first : first + count].astype(float)
    return local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]


@pytest.mark.parametrize("goal", GOALS)
def test_model_folds_as_the_planner_does(goal: GoalMesh) -> None:
    net = breadth_first_net(goal)
    plan = plan_of(net)
    compiled = compile_model(plan)
    loaded = LoadedModel(compiled, net)
    rng = np.random.default_rng(0)
    for angles in (net.fold_angle, net.fold_angle * rng.uniform(-1, 1, len(net.edges))):
        for crease in compiled.side.panel_crease[1:].tolist():
            loaded.set_angle(f"crease_{crease}", float(angles[crease]))
        mujoco.mj_kinematics(loaded.model, loaded.data)
        assert loaded.crease_angles() == pytest.approx(angles, abs=1e-15)
        prisms = prism_corners(folded_triangles(net, angles), compiled.side.insets, 0.05)
        for face in range(len(net.faces)):
            mine = world_corners(loaded, face)
            gap = np.linalg.norm(mine[:, None] - prisms[face][None], axis=2)
            assert gap.min(axis=1).max() < 2e-5  # MuJoCo keeps mesh corners as 32-bit floats
            assert gap.min(axis=0).max() < 2e-5


@pytest.mark.parametrize("goal", GOALS)
def test_nothing_touches_flat_or_folded(goal: GoalMesh) -> None:
    net = breadth_first_net(goal)
    loaded = LoadedModel(compile_model(plan_of(net)), net)
    for share in (0.0, 1.0):
        for crease in loaded.compiled.side.panel_crease[1:].tolist():
            loaded.set_angle(f"crease_{crease}", float(share * net.fold_angle[crease]))
        mujoco.mj_kinematics(loaded.model, loaded.data)
        mujoco.mj_collision(loaded.model, loaded.data)
        assert loaded.data.ncon == 0


def test_model_loads_from_a_file_and_steps_without_a_warning(tmp_path: Path) -> None:
    plan = plan_of(breadth_first_net(box()))
    path = tmp_path / "model.xml"
    path.write_text(compile_model(plan).xml)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    with quiet_mujoco() as messages:
        for _ in range(20):
            mujoco.mj_step(model, data)
    assert messages == []
    assert int(np.sum(data.warning.number)) == 0
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_DISCRETE
    assert np.all(model.jnt_springyield > 0)


def test_flat_joints_make_one_body_and_every_crease_one_hinge() -> None:
    net = breadth_first_net(box())
    compiled = compile_model(plan_of(net))
    model = compiled.load()
    creases = set(net.crease_of[net.crease_of >= 0].tolist())
    folded = {c for c in creases if net.assignment[c] != "F"}
    assert {model.joint(j).name for j in range(model.njnt)} == {f"crease_{c}" for c in folded}
    assert len(compiled.side.panel_root) == 1 + len(folded)
    for face in range(len(net.faces)):
        root = compiled.side.panel_root[compiled.side.panel_of[face]]
        assert model.body(model.geom(f"face_{face}").bodyid[0]).name == f"panel_{root}"


def test_mass_is_that_of_the_sheet() -> None:
    net = breadth_first_net(box(20, 30, 10))
    model = compile_model(plan_of(net), STEEL_304).load()
    area = 2 * (20 * 30 + 30 * 10 + 20 * 10)
    faces = [model.geom(f"face_{f}").bodyid[0] for f in range(12)]
    mass = sum(model.body_mass[b] for b in {int(b) for b in faces})
    assert mass == pytest.approx(area * 0.1 * 7900e-6, rel=1e-9)


def test_hinge_law_is_the_plate_formula() -> None:
    law = hinge_law(STEEL_304, 0.1)
    # 0.18 N m/rad for 10 mm of 0.1 mm steel over 1 mm: the figure of the design notes
    assert law.stiffness_per_mm * 10 / 1e9 == pytest.approx(0.18, rel=0.02)
    assert 0.02 < law.yield_rad < 0.05
    moment = law.stiffness_per_mm * law.yield_rad  # g mm²/s² per mm: must be sigma_y t^2 / 4
    assert moment == pytest.approx(265e6 * 0.1**2 / 4, rel=1e-12)


@pytest.mark.parametrize("bad", [{"young_pa": -1.0}, {"poisson": 0.6}, {"yield_pa": float("nan")}])
def test_metals_that_do_not_exist_are_refused(bad: dict[str, float]) -> None:
    good = {"young_pa": 2e11, "poisson": 0.3, "yield_pa": 2e8, "density_kg_m3": 8000.0}
    with pytest.raises(ModelError, match="expected"):
        SheetMetal(**(good | bad))


@pytest.mark.parametrize("thickness", [0.0, -0.1, float("nan")])
def test_thickness_must_be_positive(thickness: float) -> None:
    with pytest.raises(ValueError, match="thickness"):
        compile_model(plan_of(breadth_first_net(box()), limits=MachineLimits(thickness=thickness)))


def strip(count: int) -> GoalMesh:
    """A zigzag strip of ``count`` triangles, each turned a little against the one before."""
    k = np.arange(count + 2)
    x = np.where(k % 2 == 0, 0.0, 3.0)
    z = np.cumsum(np.where(k % 4 < 2, 0.5, -0.5))
    vertices = np.stack([x, 2.0 * k, z], axis=1)
    faces = [[i, i + 1, i + 2] if i % 2 == 0 else [i + 1, i, i + 2] for i in range(count)]
    return GoalMesh(vertices, np.array(faces), name="strip")


def test_a_net_of_400_creases_in_a_row_is_compiled() -> None:
    model = compile_model(plan_of(breadth_first_net(strip(DEEPEST_NESTING + 1)))).load()
    assert model.njnt == DEEPEST_NESTING


@pytest.mark.parametrize("deep", [DEEPEST_NESTING + 1, 500])
def test_a_net_that_is_too_deep_is_refused_in_words(deep: int) -> None:
    with pytest.raises(ModelError, match=rf"{deep} creases in a row .* at most 400: choose"):
        compile_model(plan_of(breadth_first_net(strip(deep + 1))))


def test_same_plan_same_text_and_another_plan_another() -> None:
    net = breadth_first_net(star())
    assert compile_model(plan_of(net)).sha256 == compile_model(plan_of(breadth_first_net(star()))).sha256
    assert compile_model(plan_of(net)).sha256 != compile_model(plan_of(breadth_first_net(star(6)))).sha256


def test_side_table_names_what_is_in_the_model() -> None:
    net = breadth_first_net(box())
    compiled = compile_model(plan_of(net, [Clip((0, 1))]))
    table = json.loads(compiled.side.to_json())
    model = compiled.load()
    assert len(table["faces"]) == 12
    for face in table["faces"]:
        assert model.body(face["body"]).id == model.geom_bodyid[model.geom(face["geom"]).id]
        assert face["joint"] is None or model.joint(face["joint"]).bodyid[0] == model.body(face["body"]).id
    clipped = [t for piece in table["sheet"] if piece["clipped_at_step"] == 0 for t in piece["triangles"]]
    assert sorted(clipped) == [0, 1]
    for piece in table["sheet"]:
        assert model.geom(piece["geom"]).group[0] == 2


def test_scenery_is_fitted_to_the_sheet_and_touches_nothing() -> None:
    net = breadth_first_net(box())
    limits = MachineLimits(axis_height=80.0, lens_height=120.0)
    sheet = ring_sheet(net)
    edge = int(np.flatnonzero(net.assignment == "B")[0])
    a, b = net.vertices[net.edges[edge]]
    tab = Tab(edge, tuple(a.tolist()), tuple(b.tolist()))
    sheet = type(sheet)(
        sheet.outline, sheet.vertices, sheet.faces, sheet.frame_faces, (tab,), sheet.rotary_axis
    )
    model = compile_model(plan_of(net, sheet=sheet, limits=limits)).load()
    assert model.geom("bed").pos[2] + model.geom("bed").size[2] == pytest.approx(-80.0)
    assert model.geom("laser_lens").pos[2] == pytest.approx(125.0)
    low, high = sheet.outline.min(axis=0), sheet.outline.max(axis=0)
    bar = model.geom("frame_x_min")
    assert bar.pos[0] - bar.size[0] == pytest.approx(low[0])
    assert model.geom("frame_y_max").pos[1] + model.geom("frame_y_max").size[1] == pytest.approx(high[1])
    for g in range(model.ngeom):
        name = model.geom(g).name
        if not name.startswith(("face_", "sheet_")):
            assert model.geom_contype[g] == 0 and model.geom_conaffinity[g] == 0, name
    assert model.geom("tab_0").size[0] == pytest.approx(np.linalg.norm(b - a) / 2)


@pytest.mark.parametrize("part", SCENERY_PARTS)
def test_every_part_of_the_scenery_is_a_sound_model(part: str) -> None:
    source = resources.files("models.mjcf").joinpath(f"{part}.xml")
    model = mujoco.MjModel.from_xml_string(source.read_text(encoding="utf-8"))
    data = mujoco.MjData(model)
    with quiet_mujoco() as messages:
        while data.time < 0.1:
            mujoco.mj_step(model, data)
    assert messages == []
    assert int(np.sum(data.warning.number)) == 0
    names = [model.geom(g).name for g in range(model.ngeom)]
    assert all(names) and len(set(names)) == len(names)


def test_readme_of_the_parts_names_them_all() -> None:
    text = resources.files("models.mjcf").joinpath("README.md").read_text(encoding="utf-8")
    assert all(f"`{part}.xml`" in text for part in SCENERY_PARTS)


def test_bent_substrate_has_a_hinge_that_lifts_it() -> None:
    net = breadth_first_net(box())
    ring = ring_sheet(net)
    piece = ring.vertices[ring.faces[0]]
    hinge = (tuple(piece[0].tolist()), tuple(piece[1].tolist()))
    for ends in (hinge, hinge[::-1]):
        plan = plan_of(net, [Bend((0,), ends, 0.5)], ring)
        loaded = LoadedModel(compile_model(plan), net)
        (turn,) = turns(plan, loaded.compiled.side)
        loaded.set_angle(turn.joint, turn.to_rad)
        mujoco.mj_kinematics(loaded.model, loaded.data)
        geom = loaded.piece_geom[np.flatnonzero(turn.moving_pieces)[0]]
        assert loaded.data.geom_xpos[geom, 2] > 0.5


def test_the_bars_of_the_frame_are_solids_of_their_height() -> None:
    net = breadth_first_net(box())
    ring = ring_sheet(net)
    assert ring.frame_faces.all()
    for height, half in ((0.0, 0.05), (3.0, 3.0)):
        plan = plan_of(net, [], replace(ring, clamp_height=height))
        root = ET.fromstring(compile_model(plan).xml)  # noqa: S314 - made just now
        meshes = [
            mesh.get("vertex") for mesh in root.iter("mesh") if mesh.get("name", "").startswith("sheet_")
        ]
        assert len(meshes) >= 4
        for text in meshes:
            assert set(np.abs(np.array(text.split(), float).reshape(-1, 3)[:, 2])) == {half}
        bars = [g.get("size").split() for g in root.iter("geom") if g.get("name", "").startswith("frame_")]
        assert [float(size[2]) for size in bars] == [height or 1.5] * 4


def test_gravity_and_machine_turn_against_the_rotary() -> None:
    net = breadth_first_net(box())
    loaded = LoadedModel(compile_model(plan_of(net)), net)
    for angle in np.radians([0.0, 30.0, 90.0, 180.0, -45.0]):
        turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
        assert turn @ beam_direction(angle) == pytest.approx([0, 0, 1], abs=1e-12)
        loaded.set_rotary(float(angle))
        assert turn @ loaded.model.opt.gravity == pytest.approx([0, 0, -9810.0], abs=1e-9)
        mujoco.mj_kinematics(loaded.model, loaded.data)
        head = loaded.data.geom_xpos[loaded.model.geom("laser_body").id]
        assert turn @ head == pytest.approx([0, 0, np.linalg.norm(head)], abs=1e-9)


def test_timeline_knows_what_is_gone_and_how_the_part_lies() -> None:
    net = breadth_first_net(box())
    steps = list(plan_of(net).steps)
    plan = plan_of(net, [*steps[:3], Clip((0,)), Rotate(0.3), *steps[3:]])
    compiled = compile_model(plan)
    played = turns(plan, compiled.side)
    gone = [k for k, p in enumerate(compiled.side.pieces) if p.gone_at == 3]
    assert [bool(t.gone[gone].any()) for t in played] == [t.step > 3 for t in played]
    assert [t.rotary_rad for t in played] == [np.pi if t.step < 3 else 0.3 for t in played]
    assert all(t.moving_faces.sum() == len(net.subtree[net.child_of[t.crease]]) for t in played)
