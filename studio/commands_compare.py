"""``blossom compare``: two bundles beside each other."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from studio.commands_lists import say
from studio.exit_codes import DONE
from studio.flags import Json

if TYPE_CHECKING:
    from studio.bundle_compare import Comparison, Difference

__all__ = ["compare"]


def compare(
    first: Annotated[Path, Parameter(help="Folder of a bundle.")],
    second: Annotated[Path, Parameter(help="Folder of another bundle.")],
    /,
    *,
    json: Json = False,
) -> int:
    """Show two bundles beside each other: what differs in what went in, and the figures that came out.

    A star marks the better figure. Creases that only one of them leaves short are named where both fold the
    same net. Both bundles are only read.

    Examples:
        blossom compare out/bunny out/bunny-tilted
    """
    from studio.bundle_compare import compare_bundles

    found = compare_bundles(first, second)
    if json:
        say(json_text.dumps(found.to_values(), ensure_ascii=False, allow_nan=False))
        return DONE
    say("\n".join(_lines(found, str(first), str(second))))
    return DONE


def _lines(found: Comparison, first: str, second: str) -> list[str]:
    if not found.files:
        return ["every file of the two bundles is the same"]
    rows = [("", first, second), *(_row(d) for d in (*found.inputs, *found.figures))]
    widths = [max(len(row[i]) for row in rows) for i in range(3)]
    lines = ["  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in rows]
    cut = 1 + len(found.inputs)
    out = [lines[0], *lines[1:cut], *([""] if found.inputs else []), *lines[cut:]]
    if not found.same_goal:
        out.append("note: the goals are different meshes")
    for path, creases in ((first, found.blocked_first), (second, found.blocked_second)):
        if creases:
            out.append(f"short only in {path}: crease{'s' if len(creases) > 1 else ''} {_list(creases)}")
    out.append(f"files that differ: {', '.join(found.files)}")
    return out


def _row(difference: Difference) -> tuple[str, str, str]:
    stars = ["*" if difference.better == side else "" for side in (1, 2)]
    return difference.name, difference.first + stars[0], difference.second + stars[1]


def _list(creases: tuple[int, ...], most: int = 12) -> str:
    return ", ".join(map(str, creases[:most])) + (" …" if len(creases) > most else "")
