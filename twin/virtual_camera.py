"""A camera that looks at the part in the emulated machine: rendered pictures through the real evaluation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner.net import Net
from rigs.camera import CameraGauge
from rigs.camera_file import CameraFile, CameraTable
from rigs.errors import JobError
from rigs.hinge_fit import Lens
from rigs.tag_layout import Tag, hinge_of, tags_for
from twin.part_pictures import Scene, part_picture, view_of_crease
from twin.traced_part import TracedPart

__all__ = ["VirtualCamera"]

_MATRIX = (1200.0, 0.0, 320.0), (0.0, 1200.0, 240.0), (0.0, 0.0, 1.0)
_LENS = Lens(np.array(_MATRIX), np.zeros(5))
_SIZE_PX = 640, 480
_TAG_PX, _FIELD_PX = 90.0, 330.0
_LEAN = 0.25, 0.2
_SCENE = Scene(rays=2)


@dataclass
class VirtualCamera:
    """A ``rigs.measuring.Measure``: for every crease it is held before the outer side of the fold.

    Attributes:
        net: of the part.
        traced: the part as the beam has folded it.
        scene: light, noise and blur.
    """

    net: Net
    traced: TracedPart
    scene: Scene = _SCENE

    def __post_init__(self) -> None:
        """Put a tag on both sides of every panel."""
        count = len(self.net.faces)
        below = [replace(t, number=t.number + count) for t in tags_for(self.net, side="bottom")]
        self.tags: tuple[Tag, ...] = (*tags_for(self.net), *below)
        self.shots = 0

    def __call__(self, crease: int, expected_deg: float) -> tuple[float, float]:
        """Take a picture of the crease and measure it.

        Raises:
            JobError: in words, if the picture tells no angle.
        """
        angles = self.traced.update().angles_of_net()
        side = -1.0 if expected_deg > 0.0 else 1.0
        name = "top" if side > 0.0 else "bottom"
        hinge = hinge_of(self.net, crease, [t for t in self.tags if t.side == name])
        if not hinge.fixed or not hinge.turning:
            raise JobError(f"crease {crease}: its faces have no room for a tag")
        corners = np.concatenate([*hinge.fixed.values(), *hinge.turning.values()])
        sizes = [np.linalg.norm(c[0] - c[1]) for s in (hinge.fixed, hinge.turning) for c in s.values()]
        reach = np.linalg.norm(corners - 0.5 * (hinge.start + hinge.end), axis=1).max()
        focal = float(_LENS.matrix[0, 0])
        away = max(focal * float(min(sizes)) / _TAG_PX, focal * 1.3 * float(reach) / (0.5 * _FIELD_PX))
        view = view_of_crease(
            self.net, angles, crease, _LENS, _SIZE_PX, away_mm=away, lean=_LEAN, roll_rad=0.3, side=side
        )
        self.shots += 1
        picture = part_picture(self.net, angles, self.tags, view, replace(self.scene, seed=self.shots))
        table = CameraTable(source="virtual", size_px=_SIZE_PX, matrix=_MATRIX, pictures=1)
        gauge = CameraGauge(self.net, CameraFile(schema=1, camera=table, tag=()), lambda: picture)
        gauge.tags = self.tags
        return gauge(crease, expected_deg)
