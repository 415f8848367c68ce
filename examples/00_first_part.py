"""A part in one go: what `blossom make` does, as one call."""

from pathlib import Path

from models.goals import goal_path
from studio.options import MachineOptions, MeshOptions, NetOptions, PlanOptions
from studio.pipeline import make
from studio.progress import Progress

out = Path("out/examples/bracket")
summary = make(
    out,
    MeshOptions(Path(goal_path("bracket"))),
    NetOptions(seed=0),
    PlanOptions(seed=0),
    MachineOptions(rig="grbl-4axis", material="304"),
    force=True,
    progress=Progress(),
)
print(summary.headline())
print(f"verdict: {summary.verdict}, {summary.passes} passes, replay: {summary.replay}")
print("files:", ", ".join(sorted(file.name for file in out.iterdir() if file.suffix != ".jsonl")))
