"""How often a plan comes out well when passes bend more or less than planned; with and without measuring."""

from models.goals import goal_path
from planner import make_net, plan_folds, read_goal
from rigs import load_material, load_rig, machine_limits
from twin import plan_process
from twin.scatter import run_scatter
from twin.scatter_draws import ScatterFigures, fold_turns

rig, metal = load_rig("grbl-4axis"), load_material("304")
limits = machine_limits(rig, metal)
plan = plan_folds(make_net(read_goal(goal_path("bracket"), limits=limits)), limits)
process = plan_process(plan, rig, metal)

result = run_scatter(plan, fold_turns(plan, process), ScatterFigures(*process.scatter), draws=100, seed=1)
for name, spread in (("as planned", result.open_loop), ("touched up", result.touched_up)):
    low, high = spread.interval
    print(
        f"{name}: {spread.probability:.0%} of 100 draws come out well (95 % sure: {low:.0%} to {high:.0%}), "
        f"median shape error {spread.shape_rms_mm[1]:.2f} mm"
    )
print(f"what all creases of a sheet have in common: {result.sheet_share:.0%} of the squared error")
