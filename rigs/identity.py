"""What a controller says about itself."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field

__all__ = ["Identity"]


@dataclass
class Identity:
    """What the controller says about itself.

    Attributes:
        info: lines of ``$I``; ``settings`` of ``$$``; ``offsets`` lines of ``$#``; ``modes`` line of ``$G``.
    """

    info: tuple[str, ...] = ()
    settings: dict[str, float] = field(default_factory=dict)
    offsets: tuple[str, ...] = ()
    modes: tuple[str, ...] = ()

    @property
    def emulated(self) -> bool:
        """True when ``$I`` carries the mark of the emulator."""
        return any(line.startswith("[VER:") and line.endswith(":EMULATED]") for line in self.info)

    def offset(self, name: str) -> tuple[float, ...]:
        """An offset of ``$#`` such as ``G54``; empty when it is missing."""
        for line in self.offsets:
            if line.startswith(f"[{name}:"):
                with contextlib.suppress(ValueError):
                    return tuple(float(v) for v in line[len(name) + 2 : -1].split(","))
        return ()
