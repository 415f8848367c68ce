"""Draws the pictures of docs/concepts.md: python -m docs.make_concepts writes them again."""

from __future__ import annotations

import math
from pathlib import Path

FOLDER = Path(__file__).resolve().parent / "pictures"

INK, SOFT, METAL, BEAM, HOT = "#1b2430", "#5b6675", "#0072b2", "#d55e00", "#b3005e"
Point = tuple[float, float]


class Picture:
    """Shapes in a frame of ``width`` x ``height``, y up; saved as SVG."""

    def __init__(self, name: str, title: str, width: float = 660.0, height: float = 220.0) -> None:
        self.name, self.title, self.width, self.height = name, title, width, height
        self.parts: list[str] = []

    def line(self, *points: Point, colour: str = METAL, width: float = 3.0, dash: str = "") -> None:
        """A polyline."""
        listed = " ".join(f"{x:.1f},{self.height - y:.1f}" for x, y in points)
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(
            f'<polyline points="{listed}" fill="none" stroke="{colour}" stroke-width="{width}" '
            f'stroke-linejoin="round" stroke-linecap="round"{dashed}/>'
        )

    def area(self, *points: Point, colour: str, edge: str = "none") -> None:
        """A filled polygon."""
        listed = " ".join(f"{x:.1f},{self.height - y:.1f}" for x, y in points)
        self.parts.append(f'<polygon points="{listed}" fill="{colour}" stroke="{edge}"/>')

    def dot(self, place: Point, colour: str = INK, radius: float = 4.0) -> None:
        """A small disc."""
        x, y = place
        self.parts.append(f'<circle cx="{x:.1f}" cy="{self.height - y:.1f}" r="{radius}" fill="{colour}"/>')

    def text(self, place: Point, words: str, colour: str = INK, anchor: str = "middle") -> None:
        """A line of text; the place is its baseline."""
        x, y = place
        place_text = f'x="{x:.1f}" y="{self.height - y:.1f}" text-anchor="{anchor}"'
        self.parts.append(f'<text {place_text} fill="{colour}">{words}</text>')

    def arrow(self, start: Point, end: Point, colour: str = SOFT, bow: float = 0.0) -> None:
        """An arrow, bowed to its left by a share of its length."""
        (a, b), (c, d) = start, end
        middle = ((a + c) / 2 - bow * (d - b), (b + d) / 2 + bow * (c - a))
        x, y = middle
        self.parts.append(
            f'<path d="M{a:.1f} {self.height - b:.1f} Q{x:.1f} {self.height - y:.1f} '
            f'{c:.1f} {self.height - d:.1f}" '
            f'fill="none" stroke="{colour}" stroke-width="2"/>'
        )
        heading = math.atan2(d - y, c - x)
        wings = [(c - 9 * math.cos(heading + s), d - 9 * math.sin(heading + s)) for s in (0.45, -0.45)]
        self.area(end, *wings, colour=colour)

    def beam(self, top: Point, spot: Point, width: float = 7.0) -> None:
        """A laser beam that narrows to its spot."""
        (a, b), (c, d) = top, spot
        self.area((a - width, b), (a + width, b), (c + 1.2, d), (c - 1.2, d), colour=BEAM + "66")
        self.line(top, spot, colour=BEAM, width=1.4)

    def save(self) -> None:
        """Write the file."""
        text = (
            '<svg xmlns="http://www.w3.org/2000/svg" role="img" '
            f'viewBox="0 0 {self.width:g} {self.height:g}" '
            f'font-family="system-ui, Segoe UI, Helvetica, Arial, sans-serif" font-size="14">'
            f'<title>{self.title}</title><rect width="100%" height="100%" fill="#fff"/>'
            f"{''.join(self.parts)}</svg>\n"
        )
        (FOLDER / f"{self.name}.svg").write_text(text, encoding="utf-8")


def _flap(start: Point, length: float, degrees: float) -> Point:
    angle = math.radians(degrees)
    return start[0] + length * math.cos(angle), start[1] + length * math.sin(angle)


def mechanism() -> None:
    """The temperature gradient mechanism in three sections of the sheet."""
    p = Picture("mechanism", "A laser pass bends the sheet towards the beam", height=200.0)
    for number, words in enumerate(
        ("the lit side gets hot", "it wants to grow and is squeezed", "cold, it is too short")
    ):
        x, y = 115.0 + 215.0 * number, 96.0
        p.text((x, 24), f"{number + 1}. {words}")
        lift = (0.0, -4.0, 13.0)[number]  # first away from the beam, then towards it
        left, right = (x - 88, y + lift), (x + 88, y + lift)
        p.line(left, (x, y), right, width=13)
        if number == 0:
            p.beam((x, 186), (x, y + 6))
            p.area((x - 16, y + 6), (x + 16, y + 6), (x + 6, y - 2), (x - 6, y - 2), colour=HOT)
        elif number == 1:
            p.beam((x, 186), (x, y + 6))
            p.area((x - 22, y + 6), (x + 22, y + 6), (x + 9, y - 3), (x - 9, y - 3), colour=HOT)
            p.arrow((x - 52, y + 20), (x - 22, y + 10))
            p.arrow((x + 52, y + 20), (x + 22, y + 10))
        else:
            p.arrow((x + 88, y + 18), (x + 84, y + 46), colour=INK, bow=0.15)
            p.arrow((x - 88, y + 18), (x - 84, y + 46), colour=INK, bow=-0.15)
    p.save()


def outside_in() -> None:
    """Outer creases first: the way from a turning crease to the base is flat."""
    p = Picture("outside_in", "Outer creases fold before inner ones", height=190.0)
    states = ((0.0, 0.0, "flat"), (0.0, 40.0, "outer crease first"), (55.0, 40.0, "then the inner one"))
    for number, (inner, outer, words) in enumerate(states):
        x, y = 40.0 + 220.0 * number, 58.0
        base = (x + 78, y)
        knee = _flap(base, 58, inner)
        end = _flap(knee, 46, inner + outer)
        p.line((x, y), base, colour=INK, width=6)
        p.line(base, knee, end, width=4)
        p.dot(base)
        p.dot(knee)
        p.text((x + 40, y - 20), "base", SOFT)
        p.text((x + 78, 16), words)
        lit = {1: knee, 2: base}.get(number)
        if lit:
            p.beam((lit[0], 182), lit)
    p.save()


def sight() -> None:
    """A crease that a folded part hides from the beam, and the tilt that shows it."""
    p = Picture("sight", "A tilted sheet shows a hidden crease to the beam", height=262.0)
    for number, tilt in enumerate((0.0, 38.0)):
        x, y = 165.0 + 330.0 * number, 112.0
        turn = math.radians(tilt)

        def place(a: float, b: float, x: float = x, y: float = y, turn: float = turn) -> Point:
            return x + a * math.cos(turn) - b * math.sin(turn), y + a * math.sin(turn) + b * math.cos(turn)

        p.line(place(-110, 0), place(95, 0), colour=INK, width=5)
        p.line(place(-48, 0), place(-62, 58), place(12, 74), width=4)
        p.line(place(0, 0), place(95, 0), width=5)
        p.dot(place(0, 0), HOT, 5)
        target = place(0, 0)
        if number == 0:
            p.beam((target[0], 256), (target[0], place(0, 72)[1]))
            p.line((target[0], place(0, 69)[1]), target, colour=BEAM, width=1.2, dash="4 4")
            p.text((x, 16), "straight down: the crease is hidden")
        else:
            p.beam((target[0], 256), target)
            p.text((x, 16), "tilted: the beam reaches it")
    p.save()


def substrate() -> None:
    """A flap that hangs below the sheet comes up through the metal beside the net, which is clipped."""
    p = Picture("substrate", "What a fold sweeps is clipped from the sheet", height=250.0)
    x, y, panel, flap = 300.0, 118.0, 76.0, 62.0
    crease, tip = (x, y), (x + panel, y)
    reach = math.hypot(panel, flap)
    p.line((60.0, y), (x - 92, y), colour="#8b95a3", width=6)
    p.line((x - 90, y), crease, colour=INK, width=6)
    p.line((x + panel + 2, y), (x + reach + 8, y), colour="#cc79a7", width=6, dash="9 7")
    p.line((x + reach + 12, y), (610.0, y), colour="#8b95a3", width=6)
    hang = math.degrees(math.atan2(-flap, panel))
    for turn in (0.0, 25.0, 50.0, 80.0):
        knee, end = _flap(crease, panel, turn), _flap(crease, reach, hang + turn)
        p.line(crease, knee, end, colour=METAL if turn in (0.0, 80.0) else METAL + "55", width=4)
    p.dot(crease, HOT, 5)
    p.dot(tip)
    p.beam((x, 244), crease)
    p.text((130.0, y + 14), "sheet", SOFT)
    p.text((x - 50, y + 14), "base")
    p.text((x + panel + 30, y - 20), "clipped", "#a0527f", "start")
    p.text((560.0, y + 14), "sheet, clamped", SOFT)
    p.arrow(_flap(crease, reach + 12, hang + 6), _flap(crease, reach + 12, hang + 66), bow=-0.2)
    p.text((330.0, 16), "the outer flap was folded down; when its panel rises, it comes up through the sheet")
    p.save()


def main() -> None:
    """Write all pictures."""
    for draw in (mechanism, outside_in, sight, substrate):
        draw()


if __name__ == "__main__":
    main()
