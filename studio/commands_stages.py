"""The later stages as commands of their own: plan, validate, job, replay, report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from studio.commands_make import exit_code
from studio.commands_view import ViewPort
from studio.errors import UsageError
from studio.exit_codes import DONE, NO
from studio.flags import (
    BendFlags,
    Budget,
    Bundle,
    Certify,
    Encoder,
    HeatFlags,
    Json,
    NoDiagnosis,
    Port,
    Quiet,
    Shadow,
    Tilt,
    Verbose,
    View,
    Without,
    Yes,
    not_negative,
)  # fmt: skip
from studio.live_server import DEFAULT_PORT
from studio.options import PlanOptions
from studio.progress import Progress
from studio.summary import print_summary

__all__ = ["job", "plan", "replay", "report", "validate"]


def plan(
    bundle: Bundle,
    /,
    *,
    planner: Annotated[
        str, Parameter(metavar="NAME", help="fp, the fold planner; to compare with: mp, first-block.")
    ] = "fp",
    tilt: Tilt = None,
    bend: BendFlags = BendFlags(),  # noqa: B008  frozen
    heat: HeatFlags = HeatFlags(),  # noqa: B008  frozen
    seed: Annotated[
        int | None, Parameter(metavar="N", help="Seed of every random choice [of the net].")
    ] = None,
    budget: Budget = None,
    without: Without = [],  # noqa: B006  never changed
    certify: Certify = False,
    no_diagnosis: NoDiagnosis = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Plan the folds of a net: order, angles, rotations, and the sheet with cuts, clips and tabs.

    Examples:
        blossom plan out/bunny

        blossom plan out/bunny --seed 3 --without sight
    """
    from studio.pipeline import run_stage
    from studio.stages import plan_stage
    from studio.workspace import Workspace

    def work(ws: Workspace) -> None:
        chosen = ws.manifest.parameters.get("net", {})
        options = PlanOptions(
            planner=planner, tilt_deg=tilt, seed=ws.manifest.seed if seed is None else seed, budget_s=budget,
            without=tuple(without), fixed_base=chosen.get("base") is not None,
            keep_net=chosen.get("method", "nb") != "nb",
            bend_allowance=bend.bend_allowance == "on", relief=bend.relief,
            certify=certify, diagnosis=not no_diagnosis,
            prefer=heat.prefer, start_c=heat.start_temperature, take_turns=heat.take_turns,
            heating=heat.heating,
        )  # fmt: skip
        plan_stage(ws, options)

    summary = run_stage(bundle, "plan", work, Progress(quiet=quiet or json, verbose=verbose))
    print_summary(summary, as_json=json)
    return DONE


def validate(
    bundle: Bundle,
    /,
    *,
    from_step: Annotated[
        int | None,
        Parameter(
            metavar="N", validator=not_negative,
            help="Only run again from this step on, from the checkpoint before it; changes nothing.",
        ),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:  # fmt: skip
    """Play a plan in MuJoCo and write the certificate.

    Examples:
        blossom validate out/bunny

        blossom validate out/bunny --from-step 120
    """
    if from_step is not None:
        from studio.restart_stage import print_restart, restart

        restarted = restart(bundle, from_step, Progress(quiet=quiet or json, verbose=verbose))
        print_restart(restarted, as_json=json)
        return DONE if restarted["same_state"] else NO
    from studio.pipeline import run_stage
    from studio.stages import validate_stage

    summary = run_stage(bundle, "validate", validate_stage, Progress(quiet=quiet or json, verbose=verbose))
    print_summary(summary, as_json=json)
    return exit_code(summary)


def job(bundle: Bundle, /, *, json: Json = False, quiet: Quiet = False, verbose: Verbose = False) -> int:
    """Write the instructions of the rig: G-code, and which lines belong to which step.

    Examples:
        blossom job out/bunny
    """
    from studio.pipeline import run_stage
    from studio.stages import job_stage

    summary = run_stage(bundle, "job", job_stage, Progress(quiet=quiet or json, verbose=verbose))
    print_summary(summary, as_json=json)
    return exit_code(summary)


def replay(
    bundle: Bundle,
    /,
    *,
    port: Port,
    dry_run: Annotated[
        bool, Parameter(show_default=False, help="Every move, no light (the default).")
    ] = False,
    frame: Annotated[
        bool, Parameter(show_default=False, help="Trace the outline with the pilot light.")
    ] = False,
    arm: Annotated[
        bool, Parameter(show_default=False, help="Really fire. Needs a certificate that passed.")
    ] = False,
    yes: Yes = False,
    trace: Annotated[
        Path | None,
        Parameter(metavar="FILE", help="Keep what the emulated machine did (see blossom trace)."),
    ] = None,
    shadow: Shadow = False,
    measure: Annotated[
        str | None,
        Parameter(
            metavar="typed|URL|FILE",
            help="Measure each crease after its passes and make fewer or more: typed, the port of a gauge, "
            "or a camera file (.toml).",
        ),
    ] = None,
    encoder: Encoder = None,
    view: View = False,
    view_port: ViewPort = DEFAULT_PORT,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Send the job of a bundle to a machine, block by block, each confirmed before the next.

    Ctrl-Z holds the machine, dark, until you let it go on. Ctrl-C holds the feed, switches the beam off and
    closes the journal.

    Examples:
        blossom replay out/bunny --port emulator --arm

        blossom replay out/bunny --port /dev/ttyUSB0 --frame
    """
    from studio.pipeline import replay_bundle
    from studio.replay_stage import check_measure

    if dry_run + frame + arm > 1:
        raise UsageError("--dry-run, --frame and --arm exclude each other; give one")
    mode: Literal["dry-run", "frame", "arm"] = "arm" if arm else "frame" if frame else "dry-run"
    if trace is not None and port != "emulator":
        raise UsageError("--trace is for --port emulator: a real machine keeps no trace, only the journal")
    check_measure(measure, port)
    summary = replay_bundle(
        bundle, port, mode, yes=yes, trace=trace, shadow=shadow, measure=measure, encoder=encoder,
        view_port=view_port if view else None, progress=Progress(quiet=quiet or json),
    )  # fmt: skip
    print_summary(summary, as_json=json)
    return DONE


def report(bundle: Bundle, /, *, json: Json = False, quiet: Quiet = False, verbose: Verbose = False) -> int:
    """Write the page for people and the animation.

    Examples:
        blossom report out/bunny
    """
    from studio.pipeline import run_stage
    from studio.stages import report_stage

    summary = run_stage(bundle, "report", report_stage, Progress(quiet=quiet or json, verbose=verbose))
    print_summary(summary, as_json=json)
    return DONE
