"""``blossom replay-dump``: the black box of a failed simulation, opened."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from studio.commands_lists import say
from studio.errors import UsageError
from studio.exit_codes import DONE
from studio.flags import Json

__all__ = ["replay_dump"]


def replay_dump(
    dump: Annotated[Path, Parameter(help="A bundle, or its file black-box.npz.")],
    /,
    *,
    picture: Annotated[
        Path | None, Parameter(metavar="FILE", help="Write a picture of a state (.png).")
    ] = None,
    states: Annotated[
        Path | None, Parameter(metavar="FILE", help="Write angle, rest angle and rate of every hinge (.csv).")
    ] = None,
    at: Annotated[
        int,
        Parameter(metavar="K", help="State of the picture: 0 the oldest, -1 the last."),
    ] = -1,
    json: Json = False,
) -> int:
    """Open the black box that a failed simulation left: what happened, and whether it happens again.

    Every kept step is made once more; on the same version of MuJoCo and machine it gives the same bits.

    Examples:
        blossom replay-dump out/bunny

        blossom replay-dump out/bunny/black-box.npz --picture failed.png --states failed.csv
    """
    from studio.dump_stage import dump_values, dump_words, write_dump_picture, write_dump_states
    from twin.black_box import BLACK_BOX_FILE, read_black_box
    from twin.retrace import retrace

    path = dump / BLACK_BOX_FILE if dump.is_dir() else dump
    if dump.is_dir() and not path.exists():
        raise UsageError(
            f"{dump} has no {BLACK_BOX_FILE}: blossom validate leaves one only where the simulation failed "
            "(verdict numerical)"
        )
    box = read_black_box(path)
    count = len(box.states)
    if picture is not None and picture.suffix.lower() != ".png":
        raise UsageError(f"--picture {picture}: expected a name that ends in .png")
    if not -count <= at < count:
        raise UsageError(f"--at {at}: the black box holds states 0 to {count - 1} (or -{count} to -1)")
    traced = retrace(box)
    values = dump_values(box, traced)
    written = []
    if states is not None:
        write_dump_states(traced, states)
        written.append(f"{states}: {count} states of {len(traced.joints)} hinges")
    if picture is not None:
        write_dump_picture(box, at % count, picture)
        written.append(f"{picture}: state {at % count}")
    if json:
        say(json_text.dumps(values, ensure_ascii=False, allow_nan=False))
    else:
        for line in (*dump_words(values), *written):
            say(line)
    return DONE
