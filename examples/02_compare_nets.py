"""Nets by several methods on the same mesh and base: overlaps, edits, and a net that is certified."""

from models.goals import goal_path
from planner import NET_METHODS, DualGraph, NetError, make_net, rank_bases, read_goal

goal = read_goal(goal_path("star"))
graph = DualGraph(goal)
base = rank_bases(graph)[0].face
print(f"{goal.name}: {len(goal.faces)} faces, base face {base}")
for name in ("nb", "steepest", "dijkstra", "bfs", "random"):
    attempt = NET_METHODS[name](graph, base, 0, 2.0)
    print(f"{name:<10}{len(attempt.overlapping):3d} overlapping pairs, {attempt.edits} edits")

net = make_net(goal, seed=0)
certificate = net.certificate
print(f"net: base face {net.base_face}, {certificate.edits} edits, at least {certificate.lower_bound} needed")

try:
    make_net(goal, method="bfs", base_face=base)
except NetError as error:
    print("bfs alone:", str(error).splitlines()[0])
