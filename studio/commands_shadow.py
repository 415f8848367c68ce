"""``blossom shadow``: a journal replayed into the twin."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from studio.commands_lists import say
from studio.errors import UsageError
from studio.exit_codes import DONE
from studio.flags import Bundle, Json

__all__ = ["shadow"]


def shadow(
    bundle: Bundle,
    journal: Annotated[
        Path | None, Parameter(help="Journal of a replay [the last one in the bundle].")
    ] = None,
    /,
    *,
    json: Json = False,
) -> int:
    """Replay a journal into the twin: which creases the confirmed passes folded, and how far.

    Examples:
        blossom shadow out/bunny

        blossom shadow out/bunny out/bunny/journal-002.jsonl --json
    """
    from studio.bundle_check import open_manifest
    from studio.hardware_stage import shadow_of_journal
    from studio.progress import Progress
    from studio.replay_stage import JOURNAL_PREFIX
    from studio.workspace import Workspace

    ws = Workspace(bundle, open_manifest(bundle), Progress(quiet=True))
    ws.manifest.sha256_of("job.gcode")
    if journal is None:
        found = sorted(bundle.glob(f"{JOURNAL_PREFIX}*.jsonl"))
        if not found:
            raise UsageError(f"{bundle} has no journal: replay its job first")
        journal = found[-1]
    values = shadow_of_journal(ws, journal)
    if json:
        say(json_text.dumps(values, ensure_ascii=False, allow_nan=False))
        return DONE
    say(
        f"{values['journal']}, {values['mode']} on {values['machine']}: {values['outcome']}, "
        f"{values['blocks']} blocks confirmed"
    )
    say(f"folded        {100.0 * values['fold_completion']:.1f} %")
    say(f"shape rms     {values['shape_rms_mm']:.3f} mm")
    for words in values["unlike"][:8]:
        say(f"differed      {words}")
    off = sorted(values["creases"], key=lambda row: -abs(row["angle_deg"] - row["plan_deg"]))
    for row in off[:8]:
        if abs(row["angle_deg"] - row["plan_deg"]) > 0.05:
            say(
                f"crease {row['crease']:<7}{row['angle_deg']:.1f}° of {row['plan_deg']:.1f}°, "
                f"{row['passes']:.0f} passes"
            )
    return DONE
