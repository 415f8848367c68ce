"""A plain G-code reader for tests: what a program does, from its text alone."""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Move:
    """One motion: where from, where to, S while the beam may be on (0: dark), feed in mm/min (0: rapid)."""

    start: dict[str, float]
    end: dict[str, float]
    s: float
    feed: float
    line: int


@dataclass(frozen=True)
class Program:
    """All motions, dwells (line, seconds) and the modes at the end."""

    moves: list[Move]
    dwells: list[tuple[int, float]]
    lit_at_end: bool


def read(text: str, axes: str = "XYZA") -> Program:
    """Interpret GRBL's subset: G0 G1 G4 G17 G21 G54 G90 G94, M2 M3 M4 M5, words F S and the axes."""
    place = dict.fromkeys(axes, 0.0)
    motion, feed, power, on, units = "", 0.0, 0.0, False, set()
    moves: list[Move] = []
    dwells: list[tuple[int, float]] = []
    for number, raw in enumerate(text.split("\n")[:-1], start=1):
        assert raw.isascii()
        assert len(raw) <= 78, raw
        line = re.sub(r"\([^()]*\)", "", raw).replace(" ", "")
        assert "(" not in line
        words = re.findall(r"([A-Z])(-?\d+\.?\d*)", line)
        assert "".join(a + b for a, b in words) == line, f"line {number}: {raw!r}"
        values = {a: float(b) for a, b in words if a not in "GM"}
        for code in [a + b for a, b in words if a in "GM"]:
            if code in ("G0", "G1"):
                motion = code
            elif code == "G4":
                dwells.append((number, values.pop("P")))
            elif code in ("G17", "G21", "G54", "G90", "G94"):
                units.add(code)
            elif code == "M4":
                on = True
            elif code == "M5":
                on = False
            else:
                assert code == "M2", f"line {number}: unknown {code}"
        power = values.pop("S", power)
        feed = values.pop("F", feed)
        assert power >= 0.0
        if values:
            assert units == {"G17", "G21", "G54", "G90", "G94"}, "modes are asserted before the first move"
            assert set(values) <= set(axes), f"line {number}: {raw!r}"
            there = place | values
            assert motion == "G0" or feed > 0.0
            moves.append(
                Move(
                    place,
                    there,
                    power if on and motion == "G1" else 0.0,
                    feed if motion == "G1" else 0.0,
                    number,
                )
            )
            place = there
    return Program(moves, dwells, on)
