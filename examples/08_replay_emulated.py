"""The job on the emulated machine, once clean and once with a fault; the journal says what really burnt."""

import tempfile
from pathlib import Path

from models.goals import goal_path
from planner import make_net, plan_folds, read_goal
from rigs import (
    MachineError,
    load_material,
    load_rig,
    machine_limits,
    make_job,
    read_journal,
    replay,
    start_emulator,
)
from twin import plan_process

rig, metal = load_rig("grbl-4axis"), load_material("304")
limits = machine_limits(rig, metal)
plan = plan_folds(make_net(read_goal(goal_path("bracket"), limits=limits)), limits)
job = make_job(plan, plan_process(plan, rig, metal), rig, metal, hashes={})

folder = Path(tempfile.mkdtemp())
with start_emulator("grbl-4axis") as machine:
    journal = replay(job, machine.url, rig=rig, journal_path=folder / "clean.jsonl", mode="arm")
print(f"{journal.outcome}: {len(journal.done)} blocks confirmed, emulated: {journal.emulated}")

with start_emulator("grbl-4axis", faults=["drop@300"]) as machine:
    try:
        replay(job, machine.url, rig=rig, journal_path=folder / "unplugged.jsonl", mode="arm")
    except MachineError as error:
        print("stopped:", str(error).splitlines()[0])
journal = read_journal(folder / "unplugged.jsonl")
print(f"{journal.outcome}: {len(journal.done)} blocks confirmed, in doubt: {journal.in_doubt}")
