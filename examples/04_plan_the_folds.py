"""A fold plan: steps in order, and for every crease that stays short the reason."""

from collections import Counter
from dataclasses import replace

from models.goals import goal_path
from planner import make_net, plan_folds, read_goal
from rigs import load_material, load_rig, machine_limits

limits = machine_limits(load_rig("grbl-4axis"), load_material("304"))
goal = read_goal(goal_path("box_with_lid"), limits=limits)
plan = plan_folds(make_net(goal, seed=0), limits, seed=0)

metrics = plan.metrics
print(f"folded {metrics.fold_completion:.1%}, shape {metrics.shape_rms:.3f} mm rms")
print("steps:", dict(Counter(type(step).__name__ for step in plan.steps)))
for blocked in plan.blocked:
    print(f"crease {blocked.crease} stops at {blocked.at_rad:.2f} rad by {blocked.by} of {blocked.blockers}")

# The same without tilt: the beam only comes straight down on either side.
flips = plan_folds(plan.net, replace(limits, max_tilt_rad=0.0), seed=0)
print(f"flips only: folded {flips.metrics.fold_completion:.1%}")
