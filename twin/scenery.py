"""The machine around the sheet: MJCF parts from ``models/mjcf``, merged and fitted to a plan."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from importlib import resources

import numpy as np

from planner.fold_plan import FoldPlan
from twin.errors import ModelError

__all__ = ["SCENERY_PARTS", "machine_parts", "scenery"]

SCENERY_PARTS = ("scene", "laser_head", "rotary", "frame")
"""Files of ``models/mjcf`` that make up the scenery, in the order in which they are merged."""

_SECTIONS = ("compiler", "option", "visual", "default", "asset", "worldbody", "contact")


def scenery(plan: FoldPlan) -> ET.Element:
    """The merged ``<mujoco>`` element of all parts, sized for the sheet and the limits of ``plan``.

    Bodies and assets that several parts name alike are one. Nothing of it takes part in contact.

    Raises:
        ModelError: if a part is missing from the installation or is not XML.
    """
    root = ET.Element("mujoco", model="metal-blossom")
    sections = {name: ET.SubElement(root, name) for name in _SECTIONS}
    for part in SCENERY_PARTS:
        for section in _part(part):
            target = sections[section.tag]
            target.attrib.update(section.attrib)
            for element in section:
                _merge(target, element)
    _fit(root, plan)
    return root


def machine_parts(root: ET.Element) -> dict[str, dict[str, tuple[str, ...]]]:
    """Part of ``SCENERY_PARTS`` → ``bodies``, ``geoms``, ``sites`` → names that it brought into ``root``."""
    kinds = (("bodies", "body"), ("geoms", "geom"), ("sites", "site"))
    there = {kind: {e.get("name") for e in root.iter(tag)} for kind, tag in kinds}
    out: dict[str, dict[str, tuple[str, ...]]] = {}
    for part in SCENERY_PARTS:
        world = _part(part).find("worldbody")
        out[part] = {
            kind: tuple(
                name
                for element in (world.iter(tag) if world is not None else ())
                if (name := element.get("name")) is not None and name in there[kind]
            )
            for kind, tag in kinds
        }
    return out


def _part(name: str) -> ET.Element:
    source = resources.files("models.mjcf").joinpath(f"{name}.xml")
    try:
        text = source.read_text(encoding="utf-8")
        return ET.fromstring(text)  # noqa: S314 - our own packaged data
    except (OSError, ET.ParseError) as error:
        raise ModelError(
            f"scenery part {name}.xml cannot be read ({error}): reinstall the package"
        ) from error


def _merge(target: ET.Element, element: ET.Element) -> None:
    name = element.get("name")
    for other in target:
        if name is not None and other.tag == element.tag and other.get("name") == name:
            if element.tag == "body":
                for child in element:
                    _merge(other, child)
            return
    target.append(element)


def _fit(root: ET.Element, plan: FoldPlan) -> None:
    """Set frame, chucks, stands, head and bed to the sizes of the sheet and the limits."""
    low, high = plan.sheet.outline.min(axis=0), plan.sheet.outline.max(axis=0)
    middle, half = (low + high) / 2.0, (high - low) / 2.0
    bar = max(plan.limits.frame_margin / 2.0, 1.0)
    height = plan.sheet.clamp_height or 1.5  # nothing is said: drawn so, and not in the way
    part = {g.get("name"): g for g in root.iter("geom")}

    def place(name: str, **attributes: tuple[float, ...]) -> None:
        for key, values in attributes.items():
            part[name].set(key, " ".join(repr(float(v)) for v in values))

    side = max(half[1] - 2.0 * bar, 0.5)
    place("frame_x_min", pos=(low[0] + bar, middle[1], 0.0), size=(bar, side, height))
    place("frame_x_max", pos=(high[0] - bar, middle[1], 0.0), size=(bar, side, height))
    place("frame_y_min", pos=(middle[0], low[1] + bar, 0.0), size=(half[0], bar, height))
    place("frame_y_max", pos=(middle[0], high[1] - bar, 0.0), size=(half[0], bar, height))
    place("chuck_min", fromto=(low[0] - 20.0, 0.0, 0.0, low[0], 0.0, 0.0))
    place("chuck_max", fromto=(high[0], 0.0, 0.0, high[0] + 20.0, 0.0, 0.0))
    depth, lens = plan.limits.axis_height, plan.limits.lens_height
    stand = (15.0, 25.0, (depth + 20.0) / 2.0)
    place("stand_min", pos=(low[0] - 35.0, 0.0, 20.0 - stand[2]), size=stand)
    place("stand_max", pos=(high[0] + 35.0, 0.0, 20.0 - stand[2]), size=stand)
    bed = np.maximum(half + 60.0, 100.0)
    place("bed", pos=(middle[0], middle[1], -depth - 5.0), size=(bed[0], bed[1], 5.0))
    place("laser_beam", fromto=(0.0, 0.0, 0.0, 0.0, 0.0, lens))
    place("laser_lens", fromto=(0.0, 0.0, lens, 0.0, 0.0, lens + 10.0))
    place("laser_body", pos=(0.0, 0.0, lens + 55.0))
