"""Plans with folds, cuts, waits and a release, and their jobs, for tests of process, job and G-code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.fold_plan import Cut, FoldPlan, Release, Rotate, Wait
from planner.net import Net
from rigs.job import Job
from rigs.job_build import make_job
from rigs.limits import machine_limits
from rigs.material import load_material
from rigs.process import Process
from rigs.rig import Rig, load_rig
from tests.twin.hand_plans import box, breadth_first_net, icosahedron, outside_in_steps, plan_of, star
from twin.plan_process import plan_process

GOALS = {"star": star, "box": box, "ball": icosahedron}


def centred(net: Net) -> Net:
    """The net with the middle of its bounds at the origin, where the rotary axis runs."""
    return replace(net, vertices=net.vertices - 0.5 * (net.vertices.min(axis=0) + net.vertices.max(axis=0)))


def contour(net: Net) -> tuple[tuple[tuple[float, float], ...], ...]:
    """Every cut edge of the net as a path of its own."""
    cut = np.flatnonzero(net.assignment == "B")
    return tuple(
        tuple((float(x), float(y)) for x, y in net.vertices[net.edges[edge]]) for edge in cut.tolist()
    )


def made_plan(
    goal: str = "star", rig: str = "grbl-4axis", material: str = "304", tilt_deg: float = 0.0
) -> FoldPlan:
    """Cuts first, then folds outside-in with the beam leaning by ``tilt_deg``, a wait, and the release."""
    net = centred(breadth_first_net(GOALS[goal]()))
    paths = contour(net)
    folds = [
        Rotate(step.to_rad + np.radians(tilt_deg)) if isinstance(step, Rotate) else step
        for step in [Rotate(0.0), *outside_in_steps(net)]
    ]
    steps = [Cut(paths[2:], "frees all creases"), *folds, Wait(3.0), Rotate(0.0), Release(paths[:2])]
    limits = machine_limits(load_rig(rig), load_material(material))
    return plan_of(net, steps, limits=limits)


def made(
    goal: str = "star", rig: str = "grbl-4axis", material: str = "304", tilt_deg: float = 0.0
) -> tuple[FoldPlan, Process, Rig, Job]:
    """Plan, process, rig and job of a goal."""
    plan = made_plan(goal, rig, material, tilt_deg)
    machine, metal = load_rig(rig), load_material(material)
    process = plan_process(plan, machine, metal)
    return plan, process, machine, make_job(plan, process, machine, metal, {"plan": "ab" * 32})
