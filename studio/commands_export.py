"""``blossom export``: files for other tools."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from studio.commands_lists import say
from studio.errors import UsageError
from studio.exit_codes import DONE
from studio.flags import Bundle, Json, Quiet, not_negative, positive

__all__ = ["export"]

Files = Annotated[
    list[Path],
    Parameter(
        metavar="FILE", consume_multiple=True,
        help="Files to write; the ending says what: .fold .stl .ply .obj .png .apng .mp4",
    ),
]  # fmt: skip


def export(
    bundle: Bundle,
    files: Files,
    /,
    *,
    step: Annotated[
        int | None,
        Parameter(metavar="N", validator=not_negative, help="A picture or mesh after this step [the end]."),
    ] = None,
    width: Annotated[
        int, Parameter(metavar="PIXELS", validator=positive, help="Of pictures and films.")
    ] = 960,
    height: Annotated[
        int, Parameter(metavar="PIXELS", validator=positive, help="Of pictures and films.")
    ] = 720,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Write files for other tools: the folds as FOLD frames, the shape as a mesh, pictures, a film.

    Examples:
        blossom export out/bunny folding.fold reached.stl

        blossom export out/bunny half.png --step 40

        blossom export out/bunny film.mp4
    """
    from studio.bundle_check import open_manifest
    from studio.export_files import export_file
    from studio.progress import Progress
    from studio.workspace import Workspace

    if not files:
        raise UsageError("name the files to write, such as folding.fold reached.stl film.mp4")
    if max(width, height) > 8192:
        raise UsageError("pictures of at most 8192 pixels a side")
    progress = Progress(quiet=quiet or json)
    ws = Workspace(bundle, open_manifest(bundle), progress)
    written = []
    for file in files:
        with progress.stage("export", f"writing {file.name}"):
            words = export_file(ws, file, step=step, width=width, height=height)
        written.append({"file": str(file), "bytes": file.stat().st_size, "holds": words})
        if not json:
            say(f"{file}: {words}")
    if json:
        document = {"format": "metal-blossom/export", "version": 1, "files": written}
        say(json_text.dumps(document, ensure_ascii=False))
    return DONE
