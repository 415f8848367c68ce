"""The greedy planner: its plans replayed by an independent referee, and its laws."""

import math

import numpy as np
import pytest
import trimesh

from planner.candidate import cost, flat_tree, judge
from planner.dual_graph import DualGraph
from planner.flat_layout import FlatLayout
from planner.fold_plan import MachineLimits
from planner.fold_problem import FoldProblem, panel_numbers, rotary_angles, shape_rms
from planner.fold_search import SearchSettings, search
from planner.goal_mesh import GoalMesh
from planner.insets import edge_insets
from tests.planner.fold_referee import broken_rules, poses

BODIES = {
    "box": lambda: trimesh.creation.box((30, 20, 10)),
    "ball": lambda: trimesh.creation.icosphere(subdivisions=1, radius=20),
    "cone": lambda: trimesh.creation.cone(radius=15, height=20, sections=7),
    "open_box": lambda: open_box(),
}


def open_box():
    mesh = trimesh.creation.box((30, 20, 10))
    keep = mesh.face_normals[:, 2] < 0.5
    mesh.update_faces(keep)
    return mesh


def breadth_first(graph, base):
    """A spanning tree mask: flat joints first, then by distance from the base."""
    label = list(range(len(graph.goal.faces)))

    def root(x):
        while label[x] != x:
            x = label[x]
        return x

    tree = graph.flat_forest.copy()
    for edge in np.flatnonzero(tree):
        label[root(int(graph.faces[edge, 0]))] = root(int(graph.faces[edge, 1]))
    distance, queue = {base: 0}, [base]
    for face in queue:
        for edge in graph.face_edges[face]:
            other = int(graph.faces[edge].sum()) - face
            if edge >= 0 and other not in distance:
                distance[other] = distance[face] + 1
                queue.append(other)
    for edge in sorted(range(len(graph.faces)), key=lambda e: min(distance[int(f)] for f in graph.faces[e])):
        one, other = root(int(graph.faces[edge, 0])), root(int(graph.faces[edge, 1]))
        if one != other:
            label[one], tree[edge] = other, True
    return tree


def problem_of(name, tilt_deg=45.0, **options):
    mesh = BODIES[name]()
    goal = GoalMesh(mesh.vertices, mesh.faces, name)
    graph = DualGraph(goal)
    layouts = [FlatLayout(graph, breadth_first(graph, base), base) for base in range(0, len(goal.faces), 5)]
    layouts = [layout for layout in layouts if layout.overlaps == 0]
    limits = MachineLimits(max_tilt_rad=math.radians(tilt_deg))
    insets = edge_insets(layouts[0].to_net(), limits.thickness, limits.clearance)
    return FoldProblem(goal, insets, limits, **options), layouts


@pytest.mark.parametrize("tilt_deg", [0.0, 45.0])
@pytest.mark.parametrize("name", BODIES)
def test_plans_obey_the_rules_under_an_independent_replay(name, tilt_deg):
    problem, layouts = problem_of(name, tilt_deg)
    for layout in layouts[:3]:
        tree = flat_tree(layout, 0.4)
        result = problem.fold(tree)
        assert broken_rules(
            tree, result, clearance=0.05, hidden_max=0.05, max_tilt=math.radians(tilt_deg)
        ) == []  # fmt: skip
        assert result.completion > 0.6


def test_a_full_plan_gives_the_goal():
    problem, layouts = problem_of("open_box")
    best = search(layouts, problem, SearchSettings(1, 60))[0]
    assert best.result.completion == pytest.approx(1.0, abs=1e-12)
    assert best.result.shape_rms < 1e-9
    assert (best.result.cause == 0).all()


def test_shape_error_is_that_of_the_posed_net():
    problem, layouts = problem_of("ball", 0.0)
    tree = flat_tree(layouts[0], 0.0)
    result = problem.fold(tree)
    flat = np.zeros((len(tree.parent), 3, 3))
    flat[:, :, :2] = tree.corners
    at = poses(tree, result.reached)
    world = np.einsum("fij,fkj->fki", at[:, :3, :3], flat) + at[:, None, :3, 3]
    assert result.shape_rms == pytest.approx(shape_rms(world, problem.corners_3d), abs=1e-9)
    assert result.shape_rms > 0.1


def test_moving_the_layout_rigidly_changes_nothing():
    problem, layouts = problem_of("ball")
    tree = flat_tree(layouts[0], 0.3)
    turn = np.array([[math.cos(1.1), -math.sin(1.1)], [math.sin(1.1), math.cos(1.1)]])
    moved = type(tree)(
        tree.base,
        tree.parent,
        tree.slot,
        tree.order,
        tree.corners @ turn.T + [100.0, -40.0],
        tree.target,
        turn @ tree.axis,
    )
    one, other = problem.fold(tree), problem.fold(moved)
    assert np.array_equal(one.steps[:, :2], other.steps[:, :2])
    assert np.allclose(one.reached, other.reached, atol=1e-7)


def test_the_same_plan_twice_is_the_same_bit_for_bit():
    problem, layouts = problem_of("cone")
    tree = flat_tree(layouts[0], 0.0)
    assert problem.fold(tree).steps.tobytes() == problem.fold(tree).steps.tobytes()


def test_search_depends_on_the_seed_only():
    problem, layouts = problem_of("ball")
    one, other = (search(layouts, problem, SearchSettings(1, 15, seed=4))[0] for _ in range(2))
    assert one.cost == other.cost
    assert np.array_equal(one.layout.tree, other.layout.tree)


def test_switching_rules_off_never_makes_a_net_fold_less():
    problem, layouts = problem_of("ball", 0.0)
    free, _ = problem_of("ball", 0.0, without=("sight", "contact"))
    tree = flat_tree(layouts[0], 0.0)
    assert free.fold(tree).completion == pytest.approx(1.0)
    assert problem.fold(tree).completion < 1.0


def test_a_wish_for_the_order_is_kept_where_it_can_be():
    problem, layouts = problem_of("open_box")
    tree = flat_tree(layouts[0], 0.4)
    plain = [int(f) for kind, f, _ in problem.fold(tree).steps.tolist() if kind == 1]
    above = {f: set() for f in plain}
    for face in plain:
        up = int(tree.parent[face])
        while up >= 0:
            above[face].add(up)
            up = int(tree.parent[up])
    pairs = [(a, b) for i, a in enumerate(plain) for b in plain[i + 1 :] if b not in above[a]]
    assert pairs
    for first, second in pairs:
        after = np.full(len(tree.parent), -1)
        after[first] = second
        order = [int(f) for kind, f, _ in problem.fold(tree, after=after).steps.tolist() if kind == 1]
        assert sorted(order) == sorted(plain)
        assert order.index(second) < order.index(first)
    for child in plain:  # what hangs on a crease cannot wait for it
        for carrier in above[child] & set(plain):
            after = np.full(len(tree.parent), -1)
            after[child] = carrier
            order = [int(f) for kind, f, _ in problem.fold(tree, after=after).steps.tolist() if kind == 1]
            assert order == plain


def test_obstacles_stop_a_turn():
    problem, layouts = problem_of("open_box", 0.0, without=("sight",))
    tree = flat_tree(layouts[0], 0.0)
    assert problem.fold(tree).completion == pytest.approx(1.0)
    # a plate all over the sheet, well above and under it, stands in every way
    far = 400.0
    plate = np.array([[-far, -far, 0.0], [far, -far, 0.0], [0.0, far, 0.0]])
    lids = []
    for height in (-3.0, 3.0):
        up, half = np.array([0.0, 0.0, height]), np.array([0.0, 0.0, 0.05])
        lids.append(np.concatenate([plate + up + half, plate + up - half, plate + up, plate + up]))
    stopped = problem.fold(tree, obstacles=np.array(lids))
    assert stopped.completion < 0.5
    assert set(stopped.blocker[stopped.cause == 1]) <= {len(tree.parent), len(tree.parent) + 1}
    preorder, first, last = tree.subtrees
    for face in range(len(tree.parent)):
        touches = stopped.cause[face] == 1
        assert (stopped.toucher[face] in preorder[first[face] : last[face]]) == touches
        assert touches or stopped.toucher[face] == -1


def test_a_fold_beyond_upright_needs_a_tilted_beam():
    # two triangles joined along x, folding by 120 degrees: the face itself comes between beam and crease
    vertices = [[0, 0, 0], [20, 0, 0], [10, -15, 0], [10, 15 * math.cos(2.0944), -15 * math.sin(2.0944)]]
    goal = GoalMesh(vertices, [[0, 2, 1], [0, 1, 3]])
    if DualGraph(goal).fold_angle[0] < 0:
        vertices[3][2] *= -1
        goal = GoalMesh(vertices, [[0, 2, 1], [0, 1, 3]])
    graph = DualGraph(goal)
    layout = FlatLayout(graph, np.array([True]), 0)
    insets = edge_insets(layout.to_net(), 0.1, 0.05)
    reached = {}
    for tilt in (0.0, 45.0):
        problem = FoldProblem(goal, insets, MachineLimits(max_tilt_rad=math.radians(tilt)))
        best = min((judge(layout, problem, a) for a in np.linspace(0, math.pi, 12)), key=lambda c: c.cost)
        reached[tilt] = math.degrees(np.abs(best.result.reached).max())
    assert reached[0.0] == pytest.approx(90.5, abs=0.01)
    assert reached[45.0] == pytest.approx(120.0, abs=0.01)


def test_panels_and_rotary_options():
    _, layouts = problem_of("box")
    tree = flat_tree(layouts[0], 0.0)
    panels = panel_numbers(tree, 15)
    assert len(set(panels[:12].tolist())) == 6
    assert (panels[12:] == -1).all()
    assert rotary_angles(0.0).tolist() == [0.0, math.pi]
    options = rotary_angles(math.radians(30))
    assert np.allclose(options[5:], math.pi + options[:5])


def test_load_of_a_cantilever_is_weight_times_arm():
    # a strip of two 10 x 20 mm panels: the outer one hangs on the crease between them
    points = [[0, 0, 0], [10, 0, 0], [0, 20, 0], [10, 20, 0], [0, 38, 8], [10, 38, 8]]
    goal = GoalMesh(points, [[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]])
    graph = DualGraph(goal)
    layout = FlatLayout(graph, breadth_first(graph, 0), 0)
    limits = MachineLimits(weight_n_mm2=1e-5, plastic_moment_n=0.5)
    problem = FoldProblem(goal, edge_insets(layout.to_net(), 0.1, 0.05), limits)
    loads = problem.loads(flat_tree(layout, 0.0))
    span = math.hypot(18, 8)
    expected = 1e-5 * (10 * span) * (span / 2) / (0.5 * 10)
    assert loads.max() == pytest.approx(expected, rel=1e-9)
    assert np.count_nonzero(loads) == 1


def test_giving_up_early_never_praises_a_net():
    problem, layouts = problem_of("ball", 0.0)
    whole = judge(layouts[0], problem, 0.0)
    bar = 0.25 * cost(whole.result, problem)
    stopped = judge(layouts[0], problem, 0.0, give_up=bar)
    assert stopped.cost > bar
    assert len(stopped.result.steps) < len(whole.result.steps)
