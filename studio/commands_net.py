"""``blossom net``: lay a mesh flat, prove how few edits that takes, or check such a proof."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from studio.commands_make import default_output
from studio.errors import UsageError
from studio.exit_codes import DONE
from studio.flags import (
    Base,
    Budget,
    CureFlags,
    Force,
    Json,
    MachineFlags,
    MeshFlags,
    Output,
    Quiet,
    Seed,
    Verbose,
    positive,
)  # fmt: skip
from studio.options import METHODS, NetOptions
from studio.progress import Progress
from studio.summary import print_summary

__all__ = ["net"]


def net(
    mesh: Annotated[
        Path | None,
        Parameter(help="Triangle mesh: STL, OBJ, PLY, OFF, glTF or GLB [of --verify: goal.ply beside it]."),
    ] = None,
    /,
    *,
    output: Output = None,
    method: Annotated[
        str, Parameter(metavar="NAME", help=f"How the net is found: {', '.join(METHODS)}.")
    ] = "nb",
    prove: Annotated[
        float | None,
        Parameter(
            metavar="[SECONDS]",
            validator=positive,
            help="Look for fewer edits, and prove how few there can be, for so many seconds [30].",
        ),
    ] = None,
    verify: Annotated[
        Path | None,
        Parameter(metavar="FILE", help="Make nothing: check a net.fold and the proof in it afresh."),
    ] = None,
    base: Base = None,
    cures: CureFlags = CureFlags(),  # noqa: B008  frozen
    seed: Seed = 0,
    budget: Budget = None,
    machine: MachineFlags = MachineFlags(),  # noqa: B008  frozen
    read: MeshFlags = MeshFlags(),  # noqa: B008  frozen
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    force: Force = False,
) -> int:
    """Lay a mesh flat: one piece, nothing overlaps.

    Examples:
        blossom net bunny.obj -o out/bunny

        blossom net bunny.obj -o out/bunny --method steepest --base 12

        blossom net bunny.obj -o out/bunny --prove 60

        blossom net --verify out/bunny/net.fold
    """
    from studio.pipeline import make_net_bundle

    if verify is not None:
        from studio.verify_net import verify_net

        others = {
            "--output": output, "--prove": prove, "--base": base, "--mesh-edit": cures.mesh_edit,
            "--leave-out": cures.leave_out or None, "--force": force or None,
        }  # fmt: skip
        given = [name for name, value in others.items() if value is not None]
        if given:
            raise UsageError(f"--verify makes no net: leave {given[0]} away")
        return verify_net(verify, None if mesh is None else read.options(mesh), as_json=json)
    if mesh is None:
        raise UsageError("a mesh is missing: blossom net MESH; or check a net with --verify FILE")
    summary = make_net_bundle(
        output or default_output(mesh),
        read.options(mesh),
        NetOptions(method, base, prove, seed, budget, cures.mesh_edit, cures.leave_out),
        machine.options(),
        force=force,
        progress=Progress(quiet=quiet or json, verbose=verbose),
    )
    if prove is not None:
        summary = summary.with_notice(summary.proof(prove))
    print_summary(summary, as_json=json)
    return DONE
