"""Goal shapes that ship with the product: OBJ files in mm, longest side 60 mm, made by ``make_goals``."""

from __future__ import annotations

import difflib
from importlib import resources
from pathlib import Path

__all__ = ["goal_names", "goal_path"]


def goal_names() -> tuple[str, ...]:
    """Names of the shipped goal shapes, sorted."""
    files = resources.files(__package__).iterdir()
    return tuple(sorted(file.name.removesuffix(".obj") for file in files if file.name.endswith(".obj")))


def goal_path(name: str) -> Path:
    """Path of the OBJ file of a shipped goal shape.

    Args:
        name: one of ``goal_names()``, e.g. ``"star"``.

    Raises:
        LookupError: if no shape has this name; the message lists the nearest names, or all.
    """
    names = goal_names()
    if name not in names:
        near = difflib.get_close_matches(name, names, n=3) or names
        raise LookupError(f"no shipped goal shape is called {name!r}: choose {', '.join(near)}")
    path = Path(str(resources.files(__package__).joinpath(f"{name}.obj")))
    if not path.is_file():
        raise LookupError(f"the shape {name!r} is not a file of its own: install the package unzipped")
    return path
