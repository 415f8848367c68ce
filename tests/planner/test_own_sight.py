"""What a turning part hides of its own crease: table against rays, bound against a slow one, search."""

import math

import numpy as np
import pytest

from models.goals import goal_path
from planner._kernels.cover_kernels import ABOVE_MM, END_SHARE
from planner._kernels.shadow_kernels import PER_WORD, SAMPLES, WORDS
from planner.candidate import cost, flat_tree, judge
from planner.dual_graph import DualGraph
from planner.fold_plan import MachineLimits
from planner.fold_problem import SAFE_LOAD, SIGHT_RESERVE, FoldProblem
from planner.fold_search import SearchSettings, search
from planner.insets import edge_insets
from planner.nearly_blooming import nearly_blooming
from planner.own_sight import FRACTIONS, HEADINGS, MOST_FACES, TILT_SHARES, OwnSight
from planner.read_goal import read_goal
from planner.search_moves import OwnLimit, random_trial

GOAL = read_goal(goal_path("creature_coarse"))
GRAPH = DualGraph(GOAL)
LIMITS = MachineLimits(max_tilt_rad=math.radians(45.0), beam_radius=0.05)
POINTS = 400


@pytest.fixture(scope="module")
def nets():
    attempts = (nearly_blooming(GRAPH, base, seed=0) for base in range(len(GOAL.faces)))
    return [attempt.layout for attempt in attempts if attempt.is_net][:8]


@pytest.fixture(scope="module")
def problem(nets):
    insets = edge_insets(nets[0].to_net(), LIMITS.thickness, LIMITS.clearance)
    return FoldProblem(GOAL, insets, LIMITS)


@pytest.fixture(scope="module")
def sight(problem):
    return problem.own_sight


def bit(words, tilt, sample):
    return bool(int(words[tilt // PER_WORD]) >> ((tilt % PER_WORD) * SAMPLES + sample) & 1)


def pose(side, face, sample):
    """Corners of ``face`` along the crease, towards the flat child, and up, as they stand at a sample."""
    edge, i = divmod(side, 2)
    child, slot = int(GRAPH.faces[edge, i]), int(GRAPH.slots[edge, i])
    parent = int(GRAPH.faces[edge, 1 - i])
    corners = GOAL.vertices[GOAL.faces]
    start, end = corners[child, slot], corners[child, (slot + 1) % 3]
    x = (end - start) / np.linalg.norm(end - start)
    z = GOAL.face_normals[parent]
    local = (corners[face] - start) @ np.array([x, np.cross(z, x), z]).T
    wanted = float(GRAPH.fold_angle[edge])
    turn = (FRACTIONS[sample] - 1.0) * wanted
    c, s = math.cos(turn), math.sin(turn)
    local = local @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    local[:, 2] *= math.copysign(1.0, wanted)  # a mountain is lit from below
    return local, float(np.linalg.norm(end - start))


def hidden_by_rays(triangle, length, light):
    """Share of the crease from which a thin ray to the light meets the triangle."""
    at = np.linspace(END_SHARE, 1.0 - END_SHARE, POINTS) * length
    origin = np.stack([at, np.zeros(POINTS), np.zeros(POINTS)], axis=1)
    a, b, c = triangle
    system = np.array([light, a - b, a - c]).T
    if abs(np.linalg.det(system)) < 1e-9:
        return 0.0
    far, u, v = np.linalg.solve(system, (a - origin).T)
    return float(((far * light[2] > ABOVE_MM) & (u >= 0) & (v >= 0) & (u + v <= 1)).mean())


def test_the_table_says_what_rays_say(problem, sight):
    rows, bits = sight.table[0], sight.table[1]
    limit = problem.hidden_max * SIGHT_RESERVE
    rng = np.random.default_rng(1)
    seen = {True: 0, False: 0}
    for _ in range(12_000):
        side, face = int(rng.integers(len(rows))), int(rng.integers(len(GOAL.faces)))
        edge = side // 2
        if GRAPH.flat[edge] or GRAPH.panel[face] in GRAPH.panel[GRAPH.faces[edge]]:
            assert rows[side, face] < 0
            continue
        sample, tilt = int(rng.integers(1, SAMPLES)), int(rng.integers(len(TILT_SHARES)))
        heading = int(rng.integers(HEADINGS))
        axis = math.pi * (heading + 0.5) / HEADINGS
        lean = LIMITS.max_tilt_rad * TILT_SHARES[tilt]
        # the light of a sheet that is turned by ``lean`` about the axis, seen from the sheet
        light = np.array([-math.sin(lean) * math.sin(axis), math.sin(lean) * math.cos(axis), math.cos(lean)])
        share = hidden_by_rays(*pose(side, face, sample), light)
        if abs(share - limit) < 3.0 / POINTS:
            continue
        row = rows[side, face]
        hidden = row >= 0 and bit(bits[heading, row], tilt, sample)
        assert hidden == (share > limit)
        seen[hidden] += 1
    assert seen[True] > 150
    assert seen[False] > 150


def slow_cost(layout, axis_rad, problem, sight):
    """``OwnSight.cost`` as its texts say it, from the table."""
    rows, bits, creases = sight.table[:3]
    leaning = bits[:, bits.shape[1] - len(creases) :]
    tree = flat_tree(layout, axis_rad)
    corners = GOAL.vertices[GOAL.faces]
    centres = corners.mean(axis=1)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    lost, square, overload = np.zeros(len(tree.parent)), 0.0, 0.0
    for face in tree.order[1:].tolist():
        if tree.target[face] == 0.0:
            continue
        hang = [face]
        for other in tree.order.tolist():
            if int(tree.parent[other]) in hang:
                hang.append(other)
        edge, slot = int(layout.crease[face]), int(tree.slot[face])
        side = 2 * edge + int(GRAPH.faces[edge, 1] == face)
        start = tree.corners[face, slot]
        way = tree.corners[face, (slot + 1) % 3] - start
        angle = math.atan2(way[0] * tree.axis[1] - way[1] * tree.axis[0], way @ tree.axis) % math.pi
        heading = min(HEADINGS - 1, int(angle * HEADINGS / math.pi))
        words = leaning[heading, side].copy()
        for other in hang:
            if rows[side, other] >= 0:
                words |= bits[heading, rows[side, other]]
        goal, reached = abs(tree.target[face]), 0
        while reached < SAMPLES - 1 and any(
            not bit(words, t, reached) and not bit(words, t, reached + 1) for t in range(PER_WORD * WORDS)
        ):
            reached += 1
        unit = way / np.linalg.norm(way)
        steep = math.pi / 2 + math.atan(math.tan(LIMITS.max_tilt_rad) * abs(unit @ tree.axis))
        lost[face] = max(0.0, goal * (1.0 - FRACTIONS[reached]), goal - steep - math.radians(0.5))
        line = corners[face, (slot + 1) % 3] - corners[face, slot]
        away = np.cross(centres[hang] - corners[face, slot], line / np.linalg.norm(line))
        square += (0.5 * lost[face]) ** 2 * (away**2).sum() / len(tree.parent)
        arm = (areas[hang, None] * (tree.corners[hang].mean(axis=1) - start)).sum(axis=0)
        moment = LIMITS.weight_n_mm2 * abs(unit[0] * arm[1] - unit[1] * arm[0])
        overload += max(0.0, moment / (LIMITS.plastic_moment_n * np.linalg.norm(way)) - SAFE_LOAD)
    missing = lost.sum() / np.abs(tree.target).sum()
    weight = 0.35 * math.sqrt(square) / GOAL.longest_side_mm + missing
    return weight + 0.05 * min(overload, 4.0), lost


def test_the_bound_is_what_a_slow_version_says(nets, problem, sight):
    for number, layout in enumerate(nets):
        wanted, lost = slow_cost(layout, 0.4 * number, problem, sight)
        assert wanted > 0.0
        found, missing = sight.cost(layout, 0.4 * number)
        assert missing == pytest.approx(lost, abs=1e-9)
        assert found == pytest.approx(wanted, abs=1e-9)


def test_it_orders_nets_much_as_whole_plans_do(nets, problem, sight):
    """A plan adds what else is in the way, and finer tilts take a little off."""
    plans = [judge(layout, problem, axis) for layout in nets for axis in (0.0, 0.8)]
    own = np.array([sight.cost(plan.layout, plan.axis_rad)[0] for plan in plans])
    whole = np.array([cost(plan.result, problem) for plan in plans])
    assert (own < 2.0 * whole).all()
    assert np.corrcoef(own, whole)[0, 1] > 0.5
    assert [plan.own for plan in plans] == pytest.approx(own.tolist())


def test_annealing_frees_creases_and_keeps_a_net(nets, sight):
    rng = np.random.default_rng(0)
    before = [sight.cost(layout, 0.0)[0] for layout in nets]
    made = [sight.anneal(layout, 0.0, 4000, rng) for layout in nets]
    for net in made:
        assert net.layout.overlaps == 0
        assert net.layout.free_edges() > 0
        assert sight.cost(net.layout, net.axis_rad)[0] == pytest.approx(net.cost, abs=1e-9)
    assert np.mean([net.cost for net in made]) < 0.3 * np.mean(before)
    kept = sight.anneal(nets[0], 0.0, 500, rng, fixed_base=True)
    assert kept.layout.base == nets[0].base
    again = [sight.anneal(nets[0], 0.0, 500, np.random.default_rng(5)) for _ in range(2)]
    assert np.array_equal(again[0].layout.tree, again[1].layout.tree)
    assert again[0].axis_rad == again[1].axis_rad


def test_an_exchange_stays_within_its_limit_and_free_of_overlap(nets, sight):
    rng = np.random.default_rng(2)
    done = 0
    for layout in nets:
        limit = sight.cost(layout, 0.0)[0]
        copy = layout.copy()
        found = sight.exchange(copy, 0.0, np.flatnonzero(copy.tree & ~GRAPH.flat), limit, 50, rng)
        if found is None:
            continue
        done += 1
        assert found <= limit
        assert sight.cost(copy, 0.0)[0] == pytest.approx(found, abs=1e-9)
        assert (copy.tree != layout.tree).sum() == 2
        assert len(copy.overlapping_pairs()) == 0
    assert done >= len(nets) // 2
    assert sight.exchange(nets[0].copy(), 0.0, np.zeros(0, dtype=np.int64), 1.0, 5, rng) is None


def test_no_table_where_sight_is_no_rule_or_the_goal_is_large(nets, problem):
    blind = FoldProblem(GOAL, problem.insets, LIMITS, without=("sight",))
    assert blind.own_sight is None
    assert judge(nets[0], blind, 0.0).own == 0.0
    assert len(GOAL.faces) <= MOST_FACES


def test_the_search_starts_from_better_nets_with_the_table(nets, problem):
    plain = FoldProblem(GOAL, problem.insets, LIMITS)
    plain.__dict__["own_sight"] = None
    settings = SearchSettings(chains=1, evaluations=0)
    with_table, without = (search(nets, p, settings) for p in (problem, plain))
    given = {id(layout) for layout in nets}
    made = [candidate.cost for candidate in with_table if id(candidate.layout) not in given]
    assert len(made) == len(without) == len(nets)
    assert np.mean(made) < 0.9 * np.mean([candidate.cost for candidate in without])


def test_moves_of_the_search_stay_within_the_limit(nets, problem, sight):
    plan = judge(nets[0], problem, 0.3)
    rng = np.random.default_rng(4)
    limit = OwnLimit(sight, 0.9 * plan.own)
    made = 0
    for _ in range(60):
        move = random_trial(plan.trial, plan.tree, plan.result, rng, [0.0, 1.0], fixed_base=False, own=limit)
        if move is None or (move.layout is nets[0] and move.axis_rad == plan.axis_rad):
            continue  # nothing found, or a wish for the order, which changes nothing that hides
        made += 1
        assert move.own <= limit.cost
        assert sight.cost(move.layout, move.axis_rad)[0] == pytest.approx(move.own, abs=1e-9)
    assert made > 20


def test_bridges_between_parts_are_left_alone():
    """Where nothing else could join the parts, a crease is never cut."""
    goal = read_goal(goal_path("box_with_lid"))
    graph = DualGraph(goal)
    attempts = [nearly_blooming(graph, base, seed=0) for base in range(len(goal.faces))]
    layouts = [attempt.layout for attempt in attempts if attempt.is_net]
    insets = edge_insets(layouts[0].to_net(), LIMITS.thickness, LIMITS.clearance)
    table = OwnSight(FoldProblem(goal, insets, LIMITS))
    for layout in layouts:
        made = table.anneal(layout, 0.0, 300, np.random.default_rng(0))
        assert made.layout.overlaps == 0
        assert made.cost <= table.cost(layout, 0.0)[0]
