"""From a plan to G-code: passes, power, speed and waits of every fold, then blocks of one machine."""

from pathlib import Path

from models.goals import goal_path
from planner import make_net, plan_folds, read_goal
from rigs import load_material, load_rig, machine_limits, make_job, write_gcode
from twin import plan_process

rig, metal = load_rig("grbl-4axis"), load_material("304")
limits = machine_limits(rig, metal)
plan = plan_folds(make_net(read_goal(goal_path("bracket"), limits=limits)), limits)

process = plan_process(plan, rig, metal)
for fold in process.folds[:4]:
    print(
        f"crease {fold.crease}: {fold.passes} passes of {fold.power_w:.1f} W at {fold.speed_mm_s:.0f} mm/s, "
        f"start at most {max(fold.start_c):.0f} °C"
    )
job = make_job(plan, process, rig, metal, hashes={})
gcode = write_gcode(job)
folder = Path("out/examples")
folder.mkdir(parents=True, exist_ok=True)
(folder / "bracket.gcode").write_text(gcode)
print(f"{len(job.blocks)} blocks, {job.seconds:.0f} s, {job.energy_j:.0f} J, beam on for {job.beam_s:.0f} s")
lines = gcode.splitlines()
light = next(n for n, line in enumerate(lines) if line.startswith("M4"))
print("the first light:", " | ".join(lines[light : light + 2]), "...")
