"""``blossom explain``: why creases stay short of the goal, and what would free them."""

from __future__ import annotations

import json as json_text
from typing import Annotated

from cyclopts import Parameter

from studio.errors import UsageError
from studio.exit_codes import DONE
from studio.flags import Bundle, Json, Quiet
from studio.progress import Progress

__all__ = ["explain"]


def explain(
    bundle: Bundle,
    crease: Annotated[
        int | None, Parameter(help="A crease of the net, as the summary names it [all that are blocked].")
    ] = None,
    /,
    *,
    deep: Annotated[
        bool, Parameter(show_default=False, help="Try more, and tell what does not help too.")
    ] = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Say why creases are not folded all the way: what stops each, where, and what would free it.

    Every cure was tried: the net was folded again with it, on its sheet and with all rules on. The creases
    that spoil the shape most come first. The bundle is only read.

    Examples:
        blossom explain out/bunny

        blossom explain out/bunny 88 --deep
    """
    from planner.cures import Effort
    from planner.diagnose import diagnose
    from studio.bundle_check import open_manifest
    from studio.diagnosis_words import diagnosis_values, story
    from studio.net_stage import compile_kernels
    from studio.workspace import Workspace

    progress = Progress(quiet=quiet or json)
    ws = Workspace(bundle, open_manifest(bundle), progress)
    plan = ws.plan
    if crease is not None and crease not in plan.net.child_of:
        raise UsageError(
            f"edge {crease} is not a crease of the net; leave it out to see all creases that are blocked"
        )
    chosen = [b for b in plan.blocked if crease in (None, b.crease)]
    unknown = [b for b in chosen if b.diagnosis is None or (crease is not None and b.diagnosis.tries == 0)]
    if chosen and (deep or unknown):
        compile_kernels(ws)
        with progress.stage("diagnose", "folding again with changes"):
            whole = diagnose(plan, Effort() if deep else None, only=crease)
        chosen = [b for b in whole.blocked if crease in (None, b.crease)]
    chosen.sort(key=lambda b: -b.diagnosis.loss_mm if b.diagnosis else 0.0)
    if json:
        values = {
            "format": "metal-blossom/explain",
            "version": 1,
            "fold_completion": plan.metrics.fold_completion,
            "shape_rms_mm": plan.metrics.shape_rms,
            "blocked": [diagnosis_values(plan, b) for b in chosen],
        }
        _say(json_text.dumps(values, ensure_ascii=False, allow_nan=False))
        return DONE
    if not chosen:
        _say("every crease folds all the way" if crease is None else f"crease {crease} folds all the way")
    _say("\n\n".join("\n".join(story(plan, blocked)) for blocked in chosen))
    return DONE


def _say(text: str) -> None:
    if text:
        print(text)  # noqa: T201  command output
