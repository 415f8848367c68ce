"""Firmware families: which one a controller speaks, by what it says about itself.

A profile names its dialect and the answer is checked against it; nothing is ever chosen by a guess. Sources:
``$I`` of running Grbl 1.1h, Grbl-Mega-5X and grblHAL; ``Report.cpp`` of FluidNC for its ``[VER:…]`` line;
``M115`` of Marlin.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Literal, get_args

__all__ = ["DIALECTS", "Dialect", "dialect_mistake", "spoken_dialect"]

Dialect = Literal["grbl1.1", "grbl-mega-5x", "grblhal", "fluidnc", "marlin"]
"""Firmware families; all but ``marlin`` speak Grbl 1.1's protocol."""

DIALECTS: tuple[Dialect, ...] = get_args(Dialect)

_OPTIONS = re.compile(r"\[OPT:[^,\]]*((?:,\d+)*)\]")


def spoken_dialect(info: Sequence[str]) -> Dialect | None:
    """The family that answered ``$I`` (``M115`` for Marlin) with these lines; None if none is known."""
    text = "\n".join(info)
    version = next((line for line in info if line.startswith("[VER:")), "")
    if "FIRMWARE_NAME:Marlin" in text:
        return "marlin"
    if "FluidNC" in version:
        return "fluidnc"
    options = _OPTIONS.search(text)
    if "[FIRMWARE:grblHAL]" in text or (options is not None and options[1].count(",") >= 4):
        return "grblhal"
    if not version.startswith("[VER:1.1"):
        return None
    return "grbl-mega-5x" if "[AXS:" in text else "grbl1.1"


def dialect_mistake(dialect: Dialect, info: Sequence[str]) -> str | None:
    """What is wrong if a controller does not speak the dialect of its profile, in words."""
    spoken = spoken_dialect(info)
    if spoken == dialect:
        return None
    if spoken is None:
        said = " ".join(info)[:60]
        return f"the controller does not say what it is (it answered '{said}'): is it GRBL 1.1 or Marlin?"
    return f"the controller speaks {spoken}, the profile says {dialect}: correct controller.dialect"
