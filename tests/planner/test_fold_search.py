"""How far an annealing is: by work alone, or by the clock where there is a deadline."""

import pytest

from planner import fold_search
from planner.fold_search import SearchSettings


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
