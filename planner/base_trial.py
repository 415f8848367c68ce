"""The record of one base face that was tried: how its tree bloomed, and what became of it."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

__all__ = ["BaseTrial"]


@dataclass(frozen=True)
class BaseTrial:
    """A base face with the figures that the choice among bases went by.

    Attributes:
        face: the base face.
        tree: the blooming tree that its net started from.
        overlaps: overlapping face pairs in that tree.
        bound: fewest edits of any net from that tree, as far as its overlapping paths without a common crease
            tell; holds for nets that keep flat panels whole.
        edits: edits of the net that was found, -1 if none was.
        quick_cost: what the fold planner made of that net without the sheet, lower is better; None where it
            was not asked, or the net does not fit the machine.
    """

    face: int
    tree: str
    overlaps: int
    bound: int
    edits: int
    quick_cost: float | None = None

    def to_json(self) -> dict[str, Any]:
        """As it stands in ``net.fold`` under ``blossom:bases``."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: object) -> BaseTrial:
        """Read what ``to_json`` wrote.

        Raises:
            ValueError: if a key is missing or has a wrong type.
        """
        if not isinstance(data, dict) or set(data) != {item.name for item in fields(cls)}:
            names = ", ".join(item.name for item in fields(cls))
            raise ValueError(f"a base is an object with {names}")
        for name in ("face", "overlaps", "bound", "edits"):
            if type(data[name]) is not int:
                raise ValueError(f"{name} of a base is a whole number, got {data[name]!r}")
        if not isinstance(data["tree"], str):
            raise ValueError(f"tree of a base is a word, got {data['tree']!r}")
        cost = data["quick_cost"]
        if cost is not None and type(cost) not in (int, float):
            raise ValueError(f"quick_cost of a base is a number or null, got {cost!r}")
        return cls(**data)
