"""The figures of a bundle that is a test strip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from studio.progress import duration_text
from studio.summary import Summary

if TYPE_CHECKING:
    from studio.workspace import Workspace

__all__ = ["STRIP_STAGE", "StripSummary", "is_strip", "strip_summary"]

STRIP_STAGE = "testgrid"


@dataclass(frozen=True)
class StripSummary(Summary):
    """What a user wants to know of a test strip.

    Attributes:
        pieces: fingers or windows.
        piece_kind: ``fold`` or ``kerf``.
        strip_mm: metal that is needed, width and height.
        table: the CSV to fill in.
    """

    pieces: int = 0
    piece_kind: str = "fold"
    strip_mm: tuple[float, float] = (0.0, 0.0)
    table: str = ""

    def rows(self) -> list[tuple[str, str]]:
        """Name and text of every figure that is known."""
        what = "fingers" if self.piece_kind == "fold" else "windows"
        rows = [
            ("strip", f"{self.pieces} {what} on {self.strip_mm[0]:.0f} x {self.strip_mm[1]:.0f} mm"),
            ("sheet", f"{self.thickness_mm:g} mm {self.material} on {self.rig}"),
        ]
        if self.passes:
            rows.append(("passes", str(self.passes)))
        rows += [
            ("time", duration_text(self.seconds or 0.0)),
            ("energy", f"{self.energy_j or 0.0:.0f} J"),
        ]
        if self.replay:
            rows.append(("replay", self.replay))
        rows.append(("checked", self.verdict_words()))
        if self.bundle:
            rows += [("bundle", self.bundle), ("fill in", f"{self.bundle}/{self.table}")]
        return rows


def is_strip(ws: Workspace) -> bool:
    """Whether a bundle is a test strip and no part."""
    return STRIP_STAGE in ws.manifest.parameters


def strip_summary(ws: Workspace, replay: str = "") -> StripSummary:
    """The figures of a test strip, from its files."""
    from rigs.job_file import read_job
    from studio.bundle_summary import validation_values

    job = read_job(ws.path("job.json"))
    known, checked = ws.manifest.parameters[STRIP_STAGE], validation_values(ws) or {}
    width, height = known["strip_mm"]
    return StripSummary(
        mesh="test strip", faces=0, creases=0, edits=0, planned=False, pieces=int(known["pieces"]),
        piece_kind=str(known["kind"]), strip_mm=(float(width), float(height)), table="strip.csv",
        passes=sum(block.kind == "pass" for block in job.blocks), seconds=job.seconds, energy_j=job.energy_j,
        rig=str(ws.manifest.rig["name"]), material=str(ws.manifest.material["name"]),
        thickness_mm=float(ws.manifest.material["thickness_mm"]), replay=replay,
        verdict=str(checked.get("verdict", "not validated")), process=str(checked.get("process", "")),
        notices=tuple(map(str, checked.get("notes", ()))),
    )  # fmt: skip
