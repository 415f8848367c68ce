"""A plan in the physics twin: a good one passes, one with two folds in the wrong order does not."""

from dataclasses import replace

from models.goals import goal_path
from planner import make_net, plan_folds, read_goal
from planner.fold_plan import Fold
from rigs import load_material, load_rig, machine_limits
from twin import plan_process, validate

rig, metal = load_rig("grbl-4axis"), load_material("304")
limits = machine_limits(rig, metal)
plan = plan_folds(make_net(read_goal(goal_path("bracket"), limits=limits)), limits)
validation = validate(plan, plan_process(plan, rig, metal), rig, metal)
print(
    f"verdict: {validation.verdict}; nothing nearer than {validation.closest_mm:.2f} mm "
    f"in {validation.turns} turns"
)
print(f"process: {validation.process}, grade {validation.grade}")

# Fold everything 80 degrees too far.
steps = tuple(
    replace(step, to_rad=step.to_rad + (1.396 if step.to_rad > 0 else -1.396))
    if isinstance(step, Fold)
    else step
    for step in plan.steps
)
wrong = replace(plan, steps=steps)
refused = validate(wrong, plan_process(wrong, rig, metal), rig, metal)
print(f"too far: {refused.verdict}")
for event in refused.events[:2]:
    print(" ", event.detail)
