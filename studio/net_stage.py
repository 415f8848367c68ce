"""The first stage of a run: read the mesh, lay it flat, prove what is to be proven."""

from __future__ import annotations

import difflib

from studio.errors import UsageError
from studio.manifest import file_sha256
from studio.options import MachineOptions, MeshOptions, NetOptions, parameters
from studio.workspace import Workspace

__all__ = ["compile_kernels", "known", "net_stage"]


def net_stage(ws: Workspace, mesh: MeshOptions, options: NetOptions, machine: MachineOptions) -> None:
    """Read the mesh and lay it flat: ``goal.ply``, ``net.fold`` and the profiles of rig and material.

    Raises:
        MeshError: if the mesh cannot be used.
        NetError: if it has no net.
        UsageError: if the method or the base does not exist.
    """
    from planner.cured_net import make_net_with_cures
    from planner.fold_file import write_fold
    from planner.goal_file import write_goal_ply
    from planner.net_methods import NET_METHODS
    from planner.read_goal import read_goal

    known("method", options.method, tuple(NET_METHODS))
    ws.choose_machine(machine, "net")
    with ws.progress.stage("mesh", f"reading {mesh.path.name}"):
        goal = read_goal(
            mesh.path, size_mm=mesh.size_mm, scale=mesh.scale, max_faces=mesh.faces, limits=ws.limits
        )
        write_goal_ply(goal, ws.path("goal.ply"))
    ws.manifest.input = {
        "name": mesh.path.name,
        "sha256": goal.source_sha256 or file_sha256(mesh.path),
    }
    ws.manifest.goal = {"name": goal.name, "notices": list(goal.notices), "faces": len(goal.faces)}
    ws.manifest.seed = options.seed
    ws.manifest.parameters["mesh"] = parameters(mesh)
    ws.manifest.parameters["net"] = parameters(options)
    ws.record("net", "goal.ply")
    if options.base is not None and not 0 <= options.base < len(goal.faces):
        raise UsageError(
            f"--base {options.base}: the goal has {len(goal.faces)} faces; "
            f"choose a face from 0 to {len(goal.faces) - 1}"
        )
    compile_kernels(ws)
    with ws.progress.stage("net", f"laying {len(goal.faces)} faces flat"):
        cured = make_net_with_cures(
            ws.goal,
            method=options.method,
            base_face=options.base,
            seed=options.seed,
            budget_s=options.budget_s,
            mesh_edit_mm=options.mesh_edit_mm,
            leave_out=options.leave_out,
            kerf_mm=ws.limits.kerf,
        )
        net, edit = cured.net, cured.edit
        if edit is not None:
            write_goal_ply(edit.goal, ws.path("goal.ply"))
            ws.manifest.goal |= {
                "notices": list(edit.goal.notices),
                "edit": {
                    "kind": edit.kind,
                    "deviation_mm": edit.deviation_mm,
                    "changed": [list(one) if isinstance(one, tuple) else one for one in edit.changed],
                    "goal_sha256_before": edit.before_sha256,
                    "goal_sha256": edit.goal.sha256,
                },
            }
            ws.record("net", "goal.ply")
    if options.prove_s is not None:
        from planner.prove_edits import prove_edits

        limit = options.prove_s
        with ws.progress.stage("prove", f"looking for fewer edits and a proof, {limit:g} s at most"):
            net = prove_edits(
                net,
                seed=options.seed,
                seconds=limit,
                progress=lambda edits, bound, at: ws.progress.update(
                    at / limit, f"{'no net yet' if edits < 0 else f'{edits} edits'}, at least {bound} needed"
                ),
            )
    write_fold(net, ws.path("net.fold"))
    ws.record("net", "net.fold")


def known(kind: str, name: str, choices: tuple[str, ...]) -> None:
    """Refuse a name that is none of ``choices``; the message names the nearest."""
    if name not in choices:
        near = difflib.get_close_matches(name, choices, n=1, cutoff=0.4)
        hint = f"did you mean {near[0]}? " if near else ""
        raise UsageError(f"unknown {kind} '{name}': {hint}choose one of {', '.join(choices)}")


def compile_kernels(ws: Workspace) -> None:
    """Compile what the planner needs, if it has never been; the time it takes is shown as what it is."""
    from planner.warm_up import kernels_are_cached, kernels_can_be_kept, warm_up

    if not kernels_are_cached():
        when = (
            "first run only" if kernels_can_be_kept() else "every run: no cache directory can be written to"
        )
        with ws.progress.stage("compile", f"compiling the planner's kernels ({when})"):
            warm_up(ws.progress.update)
