"""The side table of a model: which body, joint and geom stands for which part of plan and machine."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.hinge_drive import Drive
from twin.hinge_law import HingeLaw
from twin.sheet_pieces import KEPT, SheetPiece

__all__ = ["SideTable"]


@dataclass(frozen=True, eq=False)
class SideTable:
    """Which element of the model stands for what.

    A panel is a face with the faces joined to it by flat joints: one body, ``panel_<root face>``. Geoms are
    ``face_<i>`` and ``sheet_<k>``, joints ``crease_<net edge>`` and ``bend_<step>``; an actuator, where
    hinges have one, is named as its joint.

    Attributes:
        panel_of: (F,) panel of every face.
        panel_root: (P,) first face of every panel; panel 0 holds the base face.
        panel_crease: (P,) net edge that the panel turns about, -1 for panel 0.
        bend_steps: plan steps that bend substrate; each has a joint.
        pieces: the substrate as convex pieces, one geom each.
        insets: (F, 3) distance in mm by which the prism of a face stands back from its edges.
        sharp: (F,) True for faces so slim for their mitre that their middle triangle, set in by the clearance
            alone, is tested as well. If there is one, every face has a geom ``core_<i>`` and every piece of
            the sheet one ``core_sheet_<k>``: as good as flat, for the sweep only.
        thickness: of the sheet, mm.
        hinge: law of all creases.
        net_sha256: net that the model was made of.
        drive: how the hinges keep their rest angle.
        tabs: geoms of the tabs.
        machine: part (laser head, rotary, …) → kind (``bodies``, ``geoms``, ``sites``) → names.
    """

    panel_of: NDArray[np.int64]
    panel_root: NDArray[np.int64]
    panel_crease: NDArray[np.int64]
    bend_steps: tuple[int, ...]
    pieces: tuple[SheetPiece, ...]
    insets: NDArray[np.float64]
    sharp: NDArray[np.bool_]
    thickness: float
    hinge: HingeLaw
    net_sha256: str
    drive: Drive
    tabs: tuple[str, ...]
    machine: Mapping[str, Mapping[str, tuple[str, ...]]]

    @property
    def has_cores(self) -> bool:
        """Whether the model has cores."""
        return bool(self.sharp.any())

    def body_of(self, face: int) -> str:
        """Name of the body that a face belongs to."""
        return f"panel_{self.panel_root[self.panel_of[face]]}"

    def joint_of(self, face: int) -> str | None:
        """Name of the joint that a face turns about, None for the base panel."""
        crease = int(self.panel_crease[self.panel_of[face]])
        return f"crease_{crease}" if crease >= 0 else None

    def to_json(self) -> str:
        """The table as JSON for other tools: names of bodies, joints and geoms."""
        return json.dumps(
            {
                "format": "metal-blossom/model-side-table", "version": 1, "units": "mm g s rad",
                "net_sha256": self.net_sha256, "thickness": self.thickness,
                "faces": [
                    {"body": self.body_of(f), "geom": f"face_{f}", "joint": self.joint_of(f),
                     "core": f"core_{f}" if self.has_cores else None, "insets": self.insets[f].tolist()}
                    for f in range(len(self.panel_of))
                ],
                "sheet": [
                    {"geom": f"sheet_{k}", "triangles": list(p.triangles),
                     "joint": None if p.bent_at == KEPT else f"bend_{p.bent_at}",
                     "clipped_at_step": None if p.gone_at == KEPT else p.gone_at,
                     "bent_at_step": None if p.bent_at == KEPT else p.bent_at}
                    for k, p in enumerate(self.pieces)
                ],
                "tabs": [{"geom": name} for name in self.tabs],
                "machine": self.machine,
                "hinge": {"drive": self.drive, "stiffness_per_mm": self.hinge.stiffness_per_mm,
                          "damping_s": self.hinge.damping_s, "yield_rad": self.hinge.yield_rad},
            },
            indent=1,
        )  # fmt: skip
