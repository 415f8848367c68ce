"""``blossom guide``: a printable page that takes a person from the sheet to the part."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from studio.commands_lists import say
from studio.exit_codes import DONE
from studio.flags import Bundle, Json, Quiet

__all__ = ["guide"]


def guide(
    bundle: Bundle,
    /,
    *,
    output: Annotated[
        Path | None,
        Parameter(
            metavar="FILE",
            name=["-o", "--output"],
            help="A file ending in .html or .pdf [guide.html beside the bundle's folder].",
        ),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Write a guide to print: what is needed, how to set up, what to check, what happens, when it stops.

    HTML needs no other program. For PDF an installed Chromium or Chrome prints the same page; without one,
    open the HTML page and print it. The bundle is only read.

    Examples:
        blossom guide out/bunny

        blossom guide out/bunny -o bunny.pdf
    """
    from studio.guide_files import write_guide
    from studio.progress import Progress

    file = output or bundle.parent / f"{bundle.resolve().name}-guide.html"
    words = write_guide(bundle, file, Progress(quiet=quiet or json))
    if json:
        document = {
            "format": "metal-blossom/guide",
            "version": 1,
            "file": str(file),
            "bytes": file.stat().st_size,
        }
        say(json_text.dumps(document, ensure_ascii=False))
    else:
        say(words)
    return DONE
