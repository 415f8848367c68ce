"""Compile net and sheet of a plan to one MJCF model, with a table that says what became of what."""

from __future__ import annotations

import hashlib
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Bend, FoldPlan
from planner.insets import edge_insets, inset_triangles, is_sharp, plain_insets
from planner.net import Net
from planner.values import frozen_array
from twin.errors import ModelError
from twin.hinge_drive import Drive, best_drive, hinge_actuator
from twin.hinge_law import STEEL_304, HingeLaw, SheetMetal, hinge_law
from twin.scenery import machine_parts, scenery
from twin.sheet_pieces import KEPT, sheet_pieces
from twin.side_table import SideTable
from twin.units import density_g_mm3

if TYPE_CHECKING:
    import mujoco

__all__ = ["DEEPEST_NESTING", "FACE_GROUP", "SHEET_GROUP", "CompiledModel", "compile_model"]

DEEPEST_NESTING = 400
"""Most creases on one path from the base: MuJoCo's XML reader gives up at 497 nested bodies."""

FACE_GROUP, SHEET_GROUP, HIDDEN_GROUP = 1, 2, 5
"""Geom groups of faces, of substrate, and of what is not to be seen: clipped substrate, cores."""

CORE_HALF_MM = 5e-4
"""Half the thickness of a core: as flat as MuJoCo's meshes may be."""


@dataclass(frozen=True, eq=False)
class CompiledModel:
    """The MJCF text of a plan and its side table."""

    xml: str
    side: SideTable

    @cached_property
    def sha256(self) -> str:
        """Hash of the text, as it stands in the certificate."""
        return hashlib.sha256(self.xml.encode()).hexdigest()

    def load(self) -> mujoco.MjModel:
        """A fresh MuJoCo model of the text.

        Raises:
            ModelError: if MuJoCo refuses it.
        """
        import mujoco

        try:
            return mujoco.MjModel.from_xml_string(self.xml)
        except ValueError as error:
            raise ModelError(f"MuJoCo refuses the compiled model: {error}") from error


def compile_model(
    plan: FoldPlan, metal: SheetMetal = STEEL_304, *, drive: Drive | None = None
) -> CompiledModel:
    """MJCF model of net, sheet, tabs and scenery; the world is the frame of the sheet, units mm g s.

    One body per panel with its frame at one end of its crease and no rotation, one elasto-plastic hinge per
    crease (positive = valley), one prism per face and per convex piece of substrate. Angles start at 0.

    Args:
        plan: the plan.
        metal: mechanics of the sheet.
        drive: how the hinges keep their rest angle; the best that the installed MuJoCo knows if None.

    Raises:
        ModelError: if the net is nested deeper than ``DEEPEST_NESTING`` creases, or the thickness is not
            positive.
    """
    net = plan.net
    thickness = plan.limits.thickness
    law = hinge_law(metal, thickness)
    panel_of, panel_root, panel_crease, depth = _panels(net)
    if depth > DEEPEST_NESTING:
        raise ModelError(
            f"the net has {depth} creases in a row between base face {net.base_face} and its farthest face; "
            f"MuJoCo models can have at most {DEEPEST_NESTING}: choose another net method or base face"
        )
    root = scenery(plan)
    insets = edge_insets(net, thickness, plan.limits.clearance)
    plain = plain_insets(net.vertices[net.faces], plan.limits.clearance)
    side = SideTable(
        panel_of=panel_of, panel_root=panel_root, panel_crease=panel_crease,
        bend_steps=tuple(i for i, s in enumerate(plan.steps) if isinstance(s, Bend)),
        pieces=sheet_pieces(plan),
        insets=frozen_array(insets, np.float64, (None, 3)),
        sharp=frozen_array(is_sharp(insets, plain), np.bool_, (None,)),
        thickness=thickness, hinge=law, net_sha256=net.sha256, drive=drive or best_drive(),
        tabs=tuple(f"tab_{k}" for k, tab in enumerate(plan.sheet.tabs) if tab.start != tab.end),
        machine=machine_parts(root),
    )  # fmt: skip
    writer = _Writer(root, thickness, density_g_mm3(metal.density_kg_m3), law, side.drive)
    writer.net(net, side, plain)
    writer.sheet(plan, side)
    writer.tabs(plan, side)
    ET.indent(root, " ")
    return CompiledModel(ET.tostring(root, encoding="unicode") + "\n", side)


def _panels(net: Net) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], int]:
    """Panel of each face, root face and crease of each panel, and the greatest number of creases in a row."""
    panel_of = np.full(len(net.faces), -1, dtype=np.int64)
    roots: list[int] = []
    creases: list[int] = []
    depth: list[int] = []
    for face in net.order.tolist():
        parent, crease = int(net.parent[face]), int(net.crease_of[face])
        if parent >= 0 and net.assignment[crease] == "F":
            panel_of[face] = panel_of[parent]
            continue
        depth.append(depth[panel_of[parent]] + 1 if parent >= 0 else 0)
        panel_of[face] = len(roots)
        roots.append(face)
        creases.append(crease)
    return (
        frozen_array(panel_of, np.int64, (None,)), frozen_array(roots, np.int64, (None,)),
        frozen_array(creases, np.int64, (None,)), max(depth),
    )  # fmt: skip


def _numbers(values: NDArray[np.float64] | tuple[float, ...]) -> str:
    return " ".join(map(repr, np.asarray(values, dtype=np.float64).ravel().tolist()))


class _Writer:
    """Adds net and sheet to the scenery, element by element."""

    def __init__(
        self, root: ET.Element, thickness: float, density: float, law: HingeLaw, drive: Drive
    ) -> None:
        def section(name: str) -> ET.Element:
            found = root.find(name)
            return found if found is not None else ET.SubElement(root, name)

        self.asset, self.world, self.contact = section("asset"), section("worldbody"), section("contact")
        self.half = thickness / 2.0
        self.surface_density = density * thickness
        self.law, self.drive = law, drive
        if drive == "actuator":
            self.actuators = section("actuator")
        option = section("option")
        contact = {
            "condim": "1",
            "solref": f"{option.get('timestep', '0.002')} 1",
            "solimp": "0.9999 0.9999 0.01",
        }
        default = section("default")
        for name, mask, group in (("face", ("1", "3"), FACE_GROUP), ("sheet", ("2", "1"), SHEET_GROUP)):
            geom = ET.SubElement(ET.SubElement(default, "default", {"class": name}), "geom", contact)
            geom.attrib.update(
                {"type": "mesh", "contype": mask[0], "conaffinity": mask[1], "group": str(group)}
            )
        core = ET.SubElement(ET.SubElement(default, "default", {"class": "core"}), "geom")
        core.attrib.update({"type": "mesh", "contype": "0", "conaffinity": "0", "mass": "0",
                            "group": str(HIDDEN_GROUP)})  # fmt: skip

    def _prism(
        self,
        parent: ET.Element,
        name: str,
        kind: str,
        outline: NDArray[np.float64],
        area: float,
        half: float | None = None,
    ) -> ET.Element:
        """Geom of the prism over ``outline`` (K, 2), in the frame of ``parent``; mass by ``area``.

        Half its height is that of the sheet unless ``half`` says more.
        """
        half = self.half if half is None else half
        corners = np.zeros((2, len(outline), 3))
        corners[:, :, :2] = outline
        corners[0, :, 2], corners[1, :, 2] = half, -half
        ET.SubElement(self.asset, "mesh", name=name, vertex=_numbers(corners))
        return ET.SubElement(
            parent, "geom",
            {"class": kind, "name": name, "mesh": name, "mass": repr(self.surface_density * area),
             "material": "sheet" if kind == "sheet" else "steel"},
        )  # fmt: skip

    def _hinge(self, body: ET.Element, name: str, along: NDArray[np.float64]) -> None:
        length = float(np.linalg.norm(along))
        stiffness = self.law.stiffness_per_mm * length
        joint = {"name": name, "type": "hinge", "axis": _numbers((*(along / length), 0.0)),
                 "damping": repr(stiffness * self.law.damping_s)}  # fmt: skip
        if self.drive == "springyield":
            joint |= {"stiffness": repr(stiffness), "springyield": repr(self.law.yield_rad)}
        ET.SubElement(body, "joint", joint)
        if self.drive == "actuator":
            self.actuators.append(hinge_actuator(name, stiffness, self.law.yield_rad))

    def _core(self, parent: ET.Element, name: str, outline: NDArray[np.float64]) -> None:
        """Geom of the middle surface over ``outline`` (K, 2): no mass, never seen, never in a contact."""
        corners = np.zeros((2, len(outline), 3))
        corners[:, :, :2] = outline
        corners[0, :, 2], corners[1, :, 2] = CORE_HALF_MM, -CORE_HALF_MM
        ET.SubElement(self.asset, "mesh", name=name, vertex=_numbers(corners), inertia="shell")
        ET.SubElement(parent, "geom", {"class": "core", "name": name, "mesh": name})

    def net(self, net: Net, side: SideTable, plain: NDArray[np.float64]) -> None:
        """One body per panel, nested as the creases are."""
        flat = net.vertices[net.faces]
        inset, core = inset_triangles(flat, side.insets), inset_triangles(flat, plain)
        edge = flat[:, 1:] - flat[:, :1]
        areas = 0.5 * np.abs(edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0])
        bodies: list[ET.Element] = []
        origins: list[NDArray[np.float64]] = []
        for panel, face in enumerate(side.panel_root.tolist()):
            name = f"panel_{face}"
            if panel == 0:
                origin = flat[face, 0]
                body = ET.SubElement(self.world, "body", name=name, pos=_numbers((*origin, 0.0)))
            else:
                parent = int(side.panel_of[net.parent[face]])
                origin, end = net.hinge(face)
                body = ET.SubElement(
                    bodies[parent], "body", name=name, pos=_numbers((*(origin - origins[parent]), 0.0))
                )
                self._hinge(body, f"crease_{side.panel_crease[panel]}", end - origin)
                if parent == 0:  # a body welded to the world is not filtered against its children
                    ET.SubElement(self.contact, "exclude", body1=bodies[0].get("name", ""), body2=name)
            bodies.append(body)
            origins.append(origin)
            for member in np.flatnonzero(side.panel_of == panel).tolist():
                geom = self._prism(
                    body, f"face_{member}", "face", inset[member] - origin, float(areas[member])
                )
                if panel == 0:
                    geom.set("material", "base")
                if side.has_cores:
                    self._core(body, f"core_{member}", core[member] - origin)

    def sheet(self, plan: FoldPlan, side: SideTable) -> None:
        """Substrate pieces in the world; pieces that a step bends on a body of their own."""
        bent: dict[int, tuple[ET.Element, NDArray[np.float64]]] = {}
        for number in side.bend_steps:
            step = plan.steps[number]
            if not isinstance(step, Bend):
                continue
            start, end = np.array(step.hinge[0]), np.array(step.hinge[1])
            middle = plan.sheet.triangles[list(step.faces)].mean(axis=(0, 1))
            along, across = end - start, middle - start
            if along[0] * across[1] - along[1] * across[0] < 0.0:  # positive must lift the bent part
                start, end = end, start
            body = ET.SubElement(self.world, "body", name=f"bend_{number}", pos=_numbers((*start, 0.0)))
            self._hinge(body, f"bend_{number}", end - start)
            bent[number] = (body, start)
        play = max(plan.limits.clearance, plan.limits.thickness)
        for k, piece in enumerate(side.pieces):
            if piece.bent_at == KEPT:
                bars = plan.sheet.frame_faces[list(piece.triangles)].all()
                half = max(self.half, plan.sheet.clamp_height) if bars else self.half
                self._prism(self.world, f"sheet_{k}", "sheet", piece.outline, _area(piece.outline), half)
                if side.has_cores:
                    self._core(self.world, f"core_sheet_{k}", piece.outline)
                continue
            body, origin = bent[piece.bent_at]
            centre = piece.outline.mean(axis=0)
            reach = float(np.linalg.norm(piece.outline - centre, axis=1).min())
            shrunk = centre + (piece.outline - centre) * max(0.5, 1.0 - play / max(reach, 1e-9))
            self._prism(body, f"sheet_{k}", "sheet", shrunk - origin, _area(piece.outline))
            if side.has_cores:
                self._core(body, f"core_sheet_{k}", shrunk - origin)

    def tabs(self, plan: FoldPlan, side: SideTable) -> None:
        """Tabs as boxes across the kerf: to be seen, not to be touched."""
        for k, tab in enumerate(plan.sheet.tabs):
            if f"tab_{k}" not in side.tabs:
                continue
            start, end = np.array(tab.start), np.array(tab.end)
            along = end - start
            length = float(np.linalg.norm(along))
            ET.SubElement(
                self.world, "geom", name=f"tab_{k}", type="box", material="accent", contype="0",
                conaffinity="0", mass="1e-6", pos=_numbers((*((start + end) / 2.0), 0.0)),
                size=_numbers((length / 2.0, max(plan.limits.kerf, 0.05), self.half)),
                xyaxes=_numbers((*(along / length), 0.0, -along[1] / length, along[0] / length, 0.0)),
            )  # fmt: skip


def _area(outline: NDArray[np.float64]) -> float:
    x, y = outline[:, 0], outline[:, 1]
    return float(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))
