"""``blossom scatter``: how often a plan comes out well when sheet, creases and passes scatter."""

from __future__ import annotations

import json as json_text
import math
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from studio.errors import UsageError
from studio.exit_codes import DONE
from studio.flags import Bundle, Json, Quiet, not_negative, positive
from studio.progress import Progress

if TYPE_CHECKING:
    from twin.scatter import ScatterResult, Spread

__all__ = ["scatter", "scatter_lines"]

MOST_DRAWS = 100_000
"""More draws are refused: they would add nothing but time."""


def scatter(
    bundle: Bundle,
    /,
    *,
    draws: Annotated[int, Parameter(metavar="N", validator=positive, help="Draws.")] = 1000,
    touch_up: Annotated[
        bool,
        Parameter(
            show_default=False,
            help="Fold every draw a second time, measuring creases and ending each at the nearest pass.",
        ),
    ] = False,
    measure_sigma: Annotated[
        float,
        Parameter(metavar="DEG", validator=not_negative, help="Standard deviation of one measurement."),
    ] = 0.2,
    tolerance: Annotated[
        float,
        Parameter(
            metavar="SHARE",
            validator=positive,
            help="A draw may miss the shape by so much more than the plan, by the goal's diagonal.",
        ),
    ] = 0.02,
    no_sheet: Annotated[
        bool,
        Parameter(
            show_default=False,
            help="Let nothing collide with the sheet: what wider clips could gain at most.",
        ),
    ] = False,
    seed: Annotated[
        int | None, Parameter(metavar="N", validator=not_negative, help="Seed of the draws [of the plan].")
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Draw how much every pass really bends, fold the plan so, and say how often it comes out well.

    A draw passes if nothing collides on the way and the shape is hardly worse than planned. The same seed
    gives the same answer on any number of cores. The bundle is only read.

    Examples:
        blossom scatter out/bunny --draws 200

        blossom scatter out/bunny --touch-up
    """
    from studio.bundle_check import open_manifest
    from studio.net_stage import compile_kernels
    from studio.workspace import Workspace
    from twin.scatter import run_scatter
    from twin.scatter_draws import ScatterFigures, TouchUp, fold_turns
    from twin.scatter_file import scatter_values

    if draws > MOST_DRAWS:
        raise UsageError(f"--draws {draws}: expected 1 to {MOST_DRAWS}")
    progress = Progress(quiet=quiet or json)
    ws = Workspace(bundle, open_manifest(bundle), progress)
    plan, process = ws.plan, ws.process
    compile_kernels(ws)
    with progress.stage("scatter", f"folding {draws} draws"):
        result = run_scatter(
            plan, fold_turns(plan, process), ScatterFigures(*process.scatter),
            TouchUp(sigma_rad=math.radians(measure_sigma)),
            draws=draws, seed=plan.seed if seed is None else seed, tolerance_rel=tolerance,
            touch_up=touch_up, sheet=not no_sheet, on_progress=progress.update,
        )  # fmt: skip
    if json:
        values = {
            "format": "metal-blossom/scatter",
            "version": 1,
            "sheet": not no_sheet,
            **scatter_values(result),
        }
        _say(json_text.dumps(values, ensure_ascii=False, allow_nan=False))
    else:
        if no_sheet:
            _say("collisions with the sheet are left out")
        for line in scatter_lines(result):
            _say(line)
    return DONE


def scatter_lines(result: ScatterResult) -> list[str]:
    """The result in words."""
    lines = [
        f"{result.draws} draws, seed {result.seed}; a draw passes if nothing collides and the shape error is "
        f"at most {100 * result.tolerance_rel:g} % of the size above the {result.planned_rms_mm:.2f} mm of "
        "the plan"
    ]
    lines += _way("as planned", result.open_loop)
    if result.touched_up is not None:
        lines += _way("touched up", result.touched_up)
    lines.append(
        f"of the expected shape error, {100 * result.sheet_share:.0f} % (of its square) is what all creases "
        "of a sheet have in common: fit a test strip of it"
    )
    if result.creases:
        named = ", ".join(f"{c.crease} ({100 * c.share:.1f} %)" for c in result.creases[:5])
        lines.append(f"creases that matter most: {named}")
    return lines


def _way(name: str, spread: Spread) -> list[str]:
    low, high = spread.interval
    rms, angle = spread.shape_rms_mm, [math.degrees(a) for a in spread.angle_error_rad]
    rows = [
        (
            name,
            f"{100 * spread.probability:.1f} % pass (95 % sure: {100 * low:.1f} to {100 * high:.1f}); shape "
            f"within tolerance {100 * spread.in_tolerance:.1f} %, no collision "
            f"{100 * spread.contact_free:.1f} %",
        ),
        (
            "",
            f"the first collision is with the sheet in {100 * spread.sheet_hits:.1f} % of the draws",
        ),
        ("", f"shape error {rms[1]:.2f} mm ({rms[0]:.2f} to {rms[2]:.2f})"),
        ("", f"worst crease off by {angle[1]:.2f}° ({angle[0]:.2f} to {angle[2]:.2f})"),
        ("", f"{spread.passes:.0f} passes"),
    ]
    for pair in spread.pairs[:3]:
        other = f"sheet triangle {pair.still}" if pair.in_substrate else f"face {pair.still}"
        rows.append(
            ("", f"{100 * pair.share:.1f} % end at step {pair.step + 1}: face {pair.moving} meets {other}")
        )
    return [f"{label:<14}{text}" for label, text in rows]


def _say(text: str) -> None:
    print(text)  # noqa: T201  command output
