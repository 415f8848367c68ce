"""The genetic algorithm: its operators, its bookkeeping, and that it finds nets where there are some."""

from __future__ import annotations

import numpy as np
import pytest

from planner.dual_graph import DualGraph
from planner.nearly_blooming import certify
from planner.net_genetic import Evolution, GeneticSettings, genetic_net
from planner.net_methods import NET_METHODS
from planner.overlap import overlapping_triangles
from tests.planner.goal_shapes import load_obj, rough_ball, torus
from tests.planner.hand_nets import box_goal

HARD = rough_ball(80, 9, 0.75)
"""A body for which no tree of the first population is a net."""


def test_the_settings_are_those_of_the_comparison() -> None:
    used = GeneticSettings()
    assert (used.population, used.generations, used.tournament, used.children) == (400, 15_000, 7, 50)
    assert (used.swap, used.mutation, used.deviation) == (0.4, 0.01, 0.3)
    assert (used.patience, used.swap_growth, used.mutation_growth) == (100, 1.1, 1.25)


def test_fitness_counts_pairs_and_fans() -> None:
    evolution = Evolution(DualGraph(HARD), 1)
    assert evolution.genomes.shape == (400, len(evolution.judge.graph.faces))
    found = evolution.judge.judge(evolution.genomes)
    assert np.array_equal(evolution.fitness, -(found[:, 0] + 100 * found[:, 1]))
    assert evolution.best_fitness == evolution.fitness.max() < 0


def test_a_generation_replaces_the_least_fit_and_keeps_genes_in_range() -> None:
    evolution = Evolution(DualGraph(HARD), 2)
    before, fitness = evolution.genomes.copy(), evolution.fitness.copy()
    evolution.step()
    changed = np.flatnonzero((evolution.genomes != before).any(axis=1))
    assert 0 < len(changed) <= 50
    assert fitness[changed].max() <= np.sort(fitness)[49]
    best = -np.inf
    for _ in range(30):
        assert (evolution.genomes >= 0.0).all()
        assert (evolution.genomes <= 1.0).all()
        assert evolution.best_fitness >= max(best, evolution.fitness.max())
        best = evolution.best_fitness
        evolution.step()


def test_children_take_each_gene_from_their_parents() -> None:
    evolution = Evolution(DualGraph(HARD), 3, GeneticSettings(mutation=0.0, tournament=1))
    # genes that name the genome that they come from
    count = evolution.genomes.shape[1]
    evolution.genomes = np.repeat(np.arange(400) / 400.0, count).reshape(400, count)
    swapped = []
    for _ in range(20):
        children = evolution.breed()
        for one, other in zip(children[::2], children[1::2], strict=True):
            parents = np.unique([one, other])
            assert len(parents) <= 2
            if len(parents) == 2:
                assert (one + other == parents.sum()).all()
                share = float(np.mean(one == parents[0]))
                swapped.append(min(share, 1.0 - share))
    assert np.mean(swapped) == pytest.approx(0.4, abs=0.03)


def test_mutation_changes_one_gene_in_a_hundred_by_a_normal_draw() -> None:
    evolution = Evolution(DualGraph(HARD), 4, GeneticSettings(swap=0.0))
    evolution.genomes[:] = 0.5
    changed = np.concatenate([evolution.breed().ravel() for _ in range(100)])
    moved = changed[changed != 0.5] - 0.5
    assert len(moved) / len(changed) == pytest.approx(0.01, rel=0.1)
    assert np.abs(moved).max() <= 0.5
    assert moved.mean() == pytest.approx(0.0, abs=0.02)
    # a normal distribution with deviation 0.3, cut off at 5/3 deviations on both sides
    assert moved.std() == pytest.approx(0.2366, rel=0.05)


def test_idle_generations_raise_the_rates_and_success_brings_them_back() -> None:
    evolution = Evolution(DualGraph(HARD), 5, GeneticSettings(patience=2))
    evolution.best_fitness = 0  # nothing can be fitter
    for _ in range(5):
        evolution.step()
    assert evolution._mutation == pytest.approx(0.01 * 1.25**2)
    assert evolution._swap == pytest.approx(0.4 * 1.1**2)
    for _ in range(60):
        evolution.step()
    assert evolution._swap == 0.5
    assert evolution._mutation <= 1.0
    evolution.best_fitness = -(10**9)
    evolution.step()
    assert (evolution._swap, evolution._mutation) == (0.4, 0.01)


def test_it_finds_nets() -> None:
    for goal in (box_goal(), torus(), rough_ball(40, 3, 0.5), HARD):
        attempt = genetic_net(DualGraph(goal), 1, seed=6)
        assert attempt.is_net
        assert overlapping_triangles(attempt.layout.corners) == []
        assert attempt.edits == certify(attempt.layout, "ga").edits
        assert attempt.certificate("ga").lower_bound <= attempt.edits


def test_same_seed_same_net_and_the_base_does_not_matter() -> None:
    graph = DualGraph(HARD)
    one, two = (NET_METHODS["ga"](graph, 3, 5, None) for _ in range(2))
    assert np.array_equal(one.layout.tree, two.layout.tree)
    assert one.work == two.work
    first, second = Evolution(graph, 5), Evolution(graph, 6)
    assert not np.array_equal(first.genomes, second.genomes)


def test_the_budget_ends_it_with_the_best_so_far() -> None:
    graph = DualGraph(HARD)
    attempt = genetic_net(graph, 0, seed=1, budget_s=1e-9)
    assert not attempt.is_net
    assert attempt.work == 400 * len(graph.goal.faces)
    start = Evolution(graph, 1)
    assert len(attempt.overlapping) == start.judge.judge(start.best[None])[0, 0]


def test_bunny(shared_meshes) -> None:
    graph = DualGraph(load_obj(shared_meshes / "real" / "bunny-128.obj"))
    assert all(genetic_net(graph, 0, seed=seed).is_net for seed in range(3))
