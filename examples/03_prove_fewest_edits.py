"""Fewest edits with a proof that a stranger can check: the file holds it, the check needs no solver."""

import json
from pathlib import Path

from models.goals import goal_path
from planner import make_net, read_goal, verify_fold, write_fold
from planner.prove_edits import prove_edits

goal = read_goal(goal_path("star"))
net = make_net(goal, seed=0)
print(
    f"found: {net.certificate.edits} edits from the {net.certificate.tree} tree of base face {net.base_face}"
)

proven = prove_edits(net, seconds=20.0)
certificate = proven.certificate
print(f"proven: {certificate.edits} edits, none has fewer: {certificate.optimal}")

folder = Path("out/examples")
folder.mkdir(parents=True, exist_ok=True)
write_fold(proven, folder / "star.fold")
check = verify_fold(folder / "star.fold", goal)
print(f"checked afresh: the proof holds: {check.holds}, at least {check.lower_bound} edits")

# Somebody claims one edit less.
data = json.loads((folder / "star.fold").read_text())
data["blossom:certificate"]["edits"] -= 1
(folder / "forged.fold").write_text(json.dumps(data))
forged = verify_fold(folder / "forged.fold", goal)
print(f"forged: the proof holds: {forged.holds}; {forged.problems[0]}")
