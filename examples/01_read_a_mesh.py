"""Reading a mesh: what was repaired is said, what cannot be used is refused with the place."""

from pathlib import Path

from planner import MeshError, describe_mesh, read_goal

folder = Path("out/examples")
folder.mkdir(parents=True, exist_ok=True)

# A tetrahedron whose last face is wound the wrong way round.
good = folder / "tetrahedron.obj"
good.write_text("v 0 0 0\nv 30 0 0\nv 0 30 0\nv 0 0 30\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 3 4\n")
goal = read_goal(good)
print(f"{goal.name}: {len(goal.faces)} faces, longest side {goal.longest_side_mm:g} mm")
for notice in goal.notices:
    print("note:", notice)
print(f"volume {describe_mesh(goal)['volume_mm3']:.0f} mm³")

# An edge that three faces share belongs to no surface.
bad = folder / "three-at-an-edge.obj"
bad.write_text("v 0 0 0\nv 30 0 0\nv 0 30 0\nv 0 0 30\nv 0 -30 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n")
try:
    read_goal(bad)
except MeshError as error:
    print("refused:", error)
