"""The figures of a bundle: a table on a terminal, plain lines when piped, or one JSON object."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, dataclass, field, replace
from typing import Any, TextIO

from studio.progress import duration_text

__all__ = ["Summary", "print_summary"]

RUNNERS_UP = 3
"""Base faces beside the chosen one that are shown."""


@dataclass(frozen=True)
class Summary:
    """What a user wants to know of a bundle at a glance. None stands for "not known yet".

    Attributes:
        mesh: name of the goal.
        bundle: folder of the bundle, as the user gave it.
        faces: faces of the goal.
        creases: creases that fold (flat joints do not count).
        edits: creases of the net that the blooming tree does not have.
        lower_bound: fewest edits that any net needs, as far as proven.
        optimal: the edits were proven fewest.
        base_face: the face of the net that stays where it is.
        tree: the blooming tree from which edits are counted.
        bases: base faces that were tried, the chosen one first, as in ``net.fold``.
        proof_s: seconds that the proof took.
        faces_left_out: faces of the goal that the net does not have.
        completion: folded share, 0 to 1.
        shape_rms_mm: root mean square distance to the goal after the plan.
        shape_rms_rel: the same as a share of the diagonal of the goal's bounding box.
        blocked: creases that are not folded all the way, see ``studio.words.blocked_values``.
        rotations: turns of the rotary.
        clipped_faces: substrate triangles that are cut away.
        clipped_pieces: the connected pieces that they form.
        clipped_area_mm2: their area.
        passes: laser passes.
        seconds: machine time.
        energy_j: laser energy.
        heat: start temperatures in °C and waits in s; ``naive_wait_s``: until every crease is cold again.
        contact: what is proven of the turns, in words; empty if no proof was asked for.
        verdict: of the validation, or ``not validated``.
        process: ``calibrated`` or ``uncalibrated``, from the certificate; empty before there is one.
        reason: why the verdict is no, in words.
        rig: name of the machine.
        material: name of the material.
        thickness_mm: of the sheet.
        without: rules that were switched off.
        pattern: what bend allowance and kerf change, in mm; empty before there is a plan.
        replay: what the last replay came to, in words.
        notices: what the user should know.
    """

    mesh: str
    faces: int
    creases: int
    edits: int
    bundle: str = ""
    lower_bound: int = 0
    optimal: bool = False
    base_face: int = 0
    tree: str = ""
    bases: tuple[dict[str, Any], ...] = ()
    proof_s: float | None = None
    faces_left_out: int = 0
    completion: float = 0.0
    shape_rms_mm: float = 0.0
    shape_rms_rel: float = 0.0
    blocked: tuple[dict[str, Any], ...] = ()
    rotations: int = 0
    clipped_faces: int = 0
    clipped_pieces: int = 0
    clipped_area_mm2: float = 0.0
    planned: bool = True
    passes: int | None = None
    seconds: float | None = None
    energy_j: float | None = None
    heat: dict[str, float] = field(default_factory=dict)
    contact: str = ""
    verdict: str = "not validated"
    process: str = ""
    reason: str = ""
    rig: str = ""
    material: str = ""
    thickness_mm: float = 0.0
    without: tuple[str, ...] = ()
    pattern: dict[str, float] = field(default_factory=dict)
    replay: str = ""
    notices: tuple[str, ...] = ()

    def headline(self) -> str:
        """The state of the part in one line."""
        text = f"{self.faces} faces, folded {100 * self.completion:.1f} %"
        if self.faces_left_out:
            text = f"{self.faces_left_out} faces left out, {text}"
        if self.blocked:
            causes = sorted({b["by"] for b in self.blocked})
            number = "1 crease" if len(self.blocked) == 1 else f"{len(self.blocked)} creases"
            text += f", {number} blocked by {' and '.join(causes)}"
        if self.material:
            text += f", {self.thickness_mm:g} mm {self.material} on {self.rig}"
        return text

    def proof(self, limit_s: float) -> str:
        """Whether the edits are proven fewest, in words.

        Args:
            limit_s: seconds that the proof could take.
        """
        edits = _edits(self.edits)
        which = f"from the {self.tree} tree of base face {self.base_face}"
        took = "" if self.proof_s is None else f" ({duration_text(self.proof_s)})"
        if self.optimal:
            few = f"no net {which} has fewer than {edits}" if self.edits else f"no edit {which} is needed"
            return f"proven{took}: {few}"
        late = self.proof_s is not None and self.proof_s >= limit_s
        end = f"; time was up, more may help: --prove {4.0 * limit_s:g}" if late else ""
        return (
            f"not proven fewest{took}: {edits} {which}, at least {self.lower_bound} needed, "
            f"gap {self.edits - self.lower_bound}{end}"
        )

    def _base_choice(self) -> str:
        """The base face and the next best ones, with the edits of their nets."""
        others = ", ".join(
            f"{base['face']} ({_edits(base['edits']) if base['edits'] >= 0 else 'no net found'})"
            for base in self.bases[1 : 1 + RUNNERS_UP]
        )
        return f"face {self.base_face}" + (f"; next best {others}" if others else "")

    def _clipped(self) -> str:
        if not self.clipped_faces:
            return "nothing of the sheet"
        pieces = "1 piece" if self.clipped_pieces == 1 else f"{self.clipped_pieces} pieces"
        return f"{pieces} of the sheet, {self.clipped_area_mm2:.0f} mm²"

    def bends(self) -> str:
        """What is done in the flat for the radius of the bends, in words."""
        if not self.pattern.get("largest_shift_mm"):
            return "taken as sharp, nothing is moved in the flat"
        return (
            f"faces moved by up to {self.pattern['largest_shift_mm']:.2f} mm in the flat; "
            f"{self.pattern['shape_rms_without_mm']:.3f} mm rms off the shape without"
        )

    def cooling(self) -> str:
        """How long creases cool and how warm they are when a pass begins, in words."""
        heat = self.heat
        return (
            f"{duration_text(heat['wait_s'])} between passes, which begin at {heat['peak_start_c']:.0f} °C "
            f"or colder; cold again each time: {duration_text(heat['naive_wait_s'])}"
        )

    def verdict_words(self) -> str:
        """The verdict, and what a pass says of the process."""
        if self.verdict != "pass" or not self.process:
            return self.verdict
        return f"{self.verdict}: geometry passes, process {self.process}"

    def with_notice(self, notice: str) -> Summary:
        """A copy with one more notice."""
        return replace(self, notices=(*self.notices, notice))

    def with_bundle(self, bundle: str) -> Summary:
        """A copy that names the folder."""
        return replace(self, bundle=bundle)

    def to_values(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {"format": "metal-blossom/summary", "version": 1, **asdict(self)}

    def rows(self) -> list[tuple[str, str]]:
        """Name and text of every figure that is known."""
        edits = f"{self.edits}"
        if self.optimal:
            edits += " (fewest possible)"
        elif self.lower_bound:
            edits += f" (at least {self.lower_bound} needed)"
        rows = [("goal", f"{self.mesh}, {self.faces} faces, {self.creases} creases")]
        if self.faces_left_out:
            rows.append(("left out", f"{self.faces_left_out} of {self.faces + self.faces_left_out} faces"))
        rows.append(("net edits", edits))
        if self.bases:
            rows.append(("base", self._base_choice()))
        if self.planned:
            rows += [
                ("folded", f"{100 * self.completion:.1f} %"),
                ("shape rms", f"{self.shape_rms_mm:.3f} mm ({100 * self.shape_rms_rel:.2f} % of the size)"),
                ("rotations", str(self.rotations)),
                ("clipped", self._clipped()),
            ]
        if self.material:
            rows.append(("sheet", f"{self.thickness_mm:g} mm {self.material} on {self.rig}"))
        if self.pattern:
            rows.append(("bends", self.bends()))
        if self.passes is not None:
            rows.append(("passes", str(self.passes)))
        if self.seconds is not None:
            rows.append(("time", duration_text(self.seconds)))
        if self.energy_j is not None:
            rows.append(("energy", f"{self.energy_j:.0f} J"))
        if self.heat:
            rows.append(("cooling", self.cooling()))
        if self.without:
            rows.append(("switched off", ", ".join(self.without)))
        if self.contact:
            rows.append(("contact", self.contact))
        if self.replay:
            rows.append(("replay", self.replay))
        if self.planned:
            rows.append(("verdict", self.verdict_words()))
        if self.reason:
            rows.append(("because", self.reason))
        if self.bundle:
            rows.append(("bundle", self.bundle))
        return rows


def _edits(number: int) -> str:
    return "1 edit" if number == 1 else f"{number or 'no'} edits"


def print_summary(summary: Summary, *, as_json: bool = False, stream: TextIO | None = None) -> None:
    """Print a summary to ``stream`` (standard output): table, plain lines or one JSON object."""
    stream = sys.stdout if stream is None else stream
    if as_json:
        print(json.dumps(summary.to_values(), ensure_ascii=False, allow_nan=False), file=stream)
        return
    if stream.isatty():
        _print_table(summary, stream)
    else:
        for name, text in summary.rows():
            print(f"{name:<13}{text}", file=stream)
    for text in summary.notices:
        print(f"note: {text}", file=stream)
    shown = 8
    for blocked in summary.blocked[:shown]:
        print(f"blocked: {blocked['text']}", file=stream)
    if len(summary.blocked) > shown:
        print(f"blocked: and {len(summary.blocked) - shown} more, see report.html", file=stream)


def _print_table(summary: Summary, stream: TextIO) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, show_header=False, pad_edge=False)
    table.add_column(style="dim")
    table.add_column()
    colours = {"pass": "bold green", "not validated": "yellow"}
    for name, text in summary.rows():
        style = colours.get(summary.verdict, "bold red") if name == "verdict" else ""
        table.add_row(name, Text(text, style=style))
    Console(file=stream).print(table)
