"""How far an annealing is, by work alone or by the clock, and which starts are annealed how long."""

import time
from dataclasses import replace

import pytest

from planner import fold_search
from planner.candidate import judge
from planner.fold_search import (
    AGAIN_WARM,
    COLD,
    HEAT_COLD,
    HEAT_NETS,
    MOST_HEATS,
    WARM,
    SearchSettings,
    search,
)
from tests.planner.test_fold_problem import problem_of

SECONDS = 0.5


def test_without_a_deadline_only_the_work_counts(monkeypatch):
    monkeypatch.setattr(fold_search.time, "monotonic", lambda: 1e9)
    settings = SearchSettings(1, 10)
    assert [settings.share(work, began=0.0) for work in (0.0, 0.3, 1.0, 1.7)] == [0.0, 0.3, 1.0, 1.0]
    assert not settings.late


@pytest.mark.parametrize(
    ("now", "work", "share"),
    [(100.0, 0.0, 0.0), (115.0, 0.1, 0.5), (115.0, 0.8, 0.8), (130.0, 0.2, 1.0), (500.0, 0.2, 1.0)],
)
def test_with_a_deadline_the_clock_counts_if_it_is_ahead(monkeypatch, now, work, share):
    monkeypatch.setattr(fold_search.time, "monotonic", lambda: now)
    settings = SearchSettings(1, 10, deadline=130.0)
    assert settings.share(work, began=100.0) == pytest.approx(share)
    assert settings.late == (now > 130.0)


def annealings(monkeypatch, rate):
    """Start, settings and result of every annealing of a search that folds so many nets in a second."""
    problem, layouts = problem_of("box")
    plain = judge(layouts[0], problem, 0.0)
    starts = [replace(plain, cost=0.1 + 0.01 * k) for k in range(10)]
    seen = []

    def improve(start, _problem, settings, *_):
        while not settings.late:
            time.sleep(1e-3)
        better = replace(start, cost=start.cost * (0.5 + 0.01 * len(seen)))
        seen.append((start, settings, better))
        return [better]

    monkeypatch.setattr(fold_search, "improve", improve)
    monkeypatch.setattr(fold_search, "_judged", lambda *_: starts)
    monkeypatch.setattr(fold_search, "_nets_a_second", lambda *_: rate)
    monkeypatch.setattr(fold_search, "done", lambda _candidate: False)
    deadline = time.monotonic() + SECONDS
    return seen, search(layouts, problem, SearchSettings(2, 100, seed=3, deadline=deadline)), deadline


def test_where_time_is_short_each_chain_anneals_once_from_the_best_starts(monkeypatch):
    seen, found, _ = annealings(monkeypatch, rate=1.0)
    assert len(seen) == 2
    assert {settings.warm for _, settings, _ in seen} == {WARM}
    assert {settings.cold for _, settings, _ in seen} == {COLD}
    assert sorted(start.cost for start, _, _ in seen) == [0.1, 0.11]
    assert found[0].cost == min(better.cost for _, _, better in seen)


def test_short_annealings_choose_the_starts_of_the_long_ones(monkeypatch):
    seen, found, deadline = annealings(monkeypatch, rate=1000.0 * HEAT_NETS)
    heats = [(start, better) for start, settings, better in seen if settings.cold == HEAT_COLD]
    long = [(start, settings) for start, settings, _ in seen if settings.cold == COLD]
    assert len(heats) == 2 * MOST_HEATS
    assert len({id(start) for start, _ in heats}) > 2
    assert len(long) >= 2
    assert {settings.warm for _, settings in long} == {AGAIN_WARM}
    best = sorted(better.cost for _, better in heats)
    assert sorted(start.cost for start, _ in long)[:2] == best[:2]
    assert len({settings.seed for _, settings, _ in seen}) == len(seen)
    assert found == sorted(found, key=lambda candidate: candidate.cost)
    assert time.monotonic() < deadline + 1.0
