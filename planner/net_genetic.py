"""The genetic algorithm that nearly-blooming nets are compared with: edge weights evolve.

A genome has one gene in [0, 1] for every interior edge and stands for the minimum spanning tree of these.
Settings as in the public code of the paper's authors. Where that code does not do what it names, this does:
directions are uniform on the whole sphere (there one octant), and the search ends at the first net (there the
length of the cuts is then made as large as possible). Failure is an answer and asks for nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.dual_graph import DualGraph
from planner.nearly_blooming import DEFAULT_BUDGET_S, WORK_PER_SECOND, NetAttempt
from planner.net_heuristics import (
    flat_tree_weights,
    random_edge_weights,
    seen_to_hold,
    steepest_weights,
    unflat_tree_weights,
)
from planner.tree_judge import TreeJudge

__all__ = ["Evolution", "GeneticSettings", "genetic_net"]

CREATORS = (steepest_weights, flat_tree_weights, unflat_tree_weights, random_edge_weights)
"""How the first genomes are made; each is chosen for about a quarter of them."""


@dataclass(frozen=True)
class GeneticSettings:
    """Settings of the genetic algorithm.

    Attributes:
        population: genomes alive.
        generations: at most.
        tournament: genomes drawn, with repetition, for each parent; the fittest becomes one.
        children: made in each generation, in pairs; they replace as many of the least fit.
        swap: probability that a pair of children exchanges a gene (uniform crossover).
        mutation: probability that a gene changes.
        deviation: of the normal change of a gene; changes that would leave [0, 1] are drawn again.
        patience: generations without a fitter genome after which swap and mutation grow.
        swap_growth: factor of swap then; it stays at most 1/2, where children take after both parents alike.
        mutation_growth: factor of mutation then. A fitter genome brings both back to their first values.
        fan_cost: what a fan of more than a full turn weighs against an overlapping pair.
    """

    population: int = 400
    generations: int = 15_000
    tournament: int = 7
    children: int = 50
    swap: float = 0.4
    mutation: float = 0.01
    deviation: float = 0.3
    patience: int = 100
    swap_growth: float = 1.1
    mutation_growth: float = 1.25
    fan_cost: int = 100


class Evolution:
    """A population that evolves generation by generation.

    Attributes:
        judge: counts what overlaps.
        genomes: (P, M) genes.
        fitness: (P,) minus (overlapping pairs + ``fan_cost`` times fans of more than a full turn).
        generation: generations so far.
        best: (M,) the fittest genome ever.
        best_fitness: its fitness; 0 if nothing overlaps.
    """

    def __init__(self, graph: DualGraph, seed: int = 0, settings: GeneticSettings | None = None) -> None:
        """Make and judge the first population.

        Raises:
            NetError: if the goal is not one piece.
        """
        self.settings = GeneticSettings() if settings is None else settings
        self.judge = TreeJudge(graph)
        self._rng = np.random.default_rng(seed)
        creator = self._rng.integers(len(CREATORS), size=self.settings.population)
        self.genomes = np.empty((self.settings.population, len(graph.faces)))
        for number, create in enumerate(CREATORS):
            rows = np.flatnonzero(creator == number)
            self.genomes[rows] = create(self.judge, len(rows), self._rng)
        self.fitness = self._fitness_of(self.genomes)
        self.generation = 0
        self._idle = 0
        self._swap, self._mutation = self.settings.swap, self.settings.mutation
        top = int(np.argmax(self.fitness))
        self.best, self.best_fitness = self.genomes[top].copy(), int(self.fitness[top])

    @property
    def is_done(self) -> bool:
        """True if a tree without overlap was found, or the last generation was reached."""
        return self.best_fitness == 0 or self.generation >= self.settings.generations

    def step(self) -> None:
        """One generation: children of the fittest of tournaments replace the least fit."""
        children = self.breed()
        fitness = self._fitness_of(children)
        worst = np.argsort(self.fitness, kind="stable")[: len(children)]
        self.genomes[worst], self.fitness[worst] = children, fitness
        self.generation += 1
        top = int(np.argmax(fitness))
        if fitness[top] > self.best_fitness:
            self.best, self.best_fitness = children[top].copy(), int(fitness[top])
            self._idle = 0
            self._swap, self._mutation = self.settings.swap, self.settings.mutation
            return
        self._idle += 1
        if self._idle % self.settings.patience == 0:
            self._swap = min(0.5, self._swap * self.settings.swap_growth)
            self._mutation = min(1.0, self._mutation * self.settings.mutation_growth)

    def breed(self) -> NDArray[np.float64]:
        """(children, M) genomes: parents by tournament, genes exchanged within pairs, then mutated."""
        settings, rng = self.settings, self._rng
        drawn = rng.integers(settings.population, size=(settings.children, settings.tournament))
        winners = drawn[np.arange(settings.children), np.argmax(self.fitness[drawn], axis=1)]
        children: NDArray[np.float64] = self.genomes[winners]
        one, other = children[0 : settings.children - 1 : 2], children[1 : settings.children : 2]
        exchanged = rng.random(one.shape) < self._swap
        one[exchanged], other[exchanged] = other[exchanged], one[exchanged]
        row, gene = np.nonzero(rng.random(children.shape) < self._mutation)
        children[row, gene] = self._mutated(children[row, gene])
        return children

    def _mutated(self, genes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Genes plus a normal change, drawn again until all lie in [0, 1]."""
        changed = genes + self._rng.normal(0.0, self.settings.deviation, len(genes))
        while True:
            outside = np.flatnonzero((changed < 0.0) | (changed > 1.0))
            if not len(outside):
                return changed
            changed[outside] = genes[outside] + self._rng.normal(0.0, self.settings.deviation, len(outside))

    def _fitness_of(self, genomes: NDArray[np.float64]) -> NDArray[np.int64]:
        found = self.judge.judge(genomes)
        fitness: NDArray[np.int64] = -(found[:, 0] + self.settings.fan_cost * found[:, 1])
        return fitness


def genetic_net(
    graph: DualGraph,
    base: int,
    seed: int = 0,
    budget_s: float | None = None,
    settings: GeneticSettings | None = None,
) -> NetAttempt:
    """What the genetic algorithm finds; the hold of the base is seen to afterwards, as for plain trees.

    What overlaps does not depend on the base face, so the same seed evolves the same tree for every base.

    Args:
        graph: the dual graph of the goal.
        base: the base face.
        seed: of the random choices.
        budget_s: nominal seconds, counted as work (``WORK_PER_SECOND``): faces of the trees that were judged.
        settings: other settings than the paper's comparison.

    Raises:
        NetError: if the goal is not one piece, or ``base`` is not a face.
    """
    limit = (DEFAULT_BUDGET_S if budget_s is None else budget_s) * WORK_PER_SECOND
    evolution = Evolution(graph, seed, settings)
    while not evolution.is_done and evolution.judge.work < limit:
        evolution.step()
    tree = evolution.judge.tree(evolution.best)
    return seen_to_hold(evolution.judge, tree, base, seed=seed, budget_s=budget_s)
