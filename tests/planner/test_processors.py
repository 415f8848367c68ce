"""Work on several processors: the order of the results, how far ahead is worked, and what goes wrong."""

import threading

import pytest

from planner import processors as module
from planner.processors import side_by_side


@pytest.fixture(params=[1, 2, 5])
def many(request, monkeypatch):
    """How many processors there seem to be."""
    monkeypatch.setattr(module, "processors", lambda: request.param)
    return request.param


def test_results_come_in_the_order_of_the_items(many):
    last = threading.Event()

    def slow_at_first(item):
        if item == 0 and many > 1:
            assert last.wait(10.0)  # the next one is worked out meanwhile
        if item == 1:
            last.set()
        return item * item

    assert list(side_by_side(slow_at_first, range(12))) == [item * item for item in range(12)]


def test_who_stops_asking_wastes_no_more_than_the_processors_have_begun(many):
    begun = []
    for result in side_by_side(lambda item: begun.append(item) or item, range(100)):
        if result == 3:
            break
    assert begun[:4] == [0, 1, 2, 3]
    assert len(begun) <= 4 + many - 1


def test_an_error_reaches_the_caller_at_its_item(many):
    def fails_at_two(item):
        if item == 2:
            raise ValueError("two")
        return item

    seen = []
    with pytest.raises(ValueError, match="two"):
        seen.extend(side_by_side(fails_at_two, range(10)))
    assert seen == [0, 1]


def test_no_items_no_results(many):
    assert list(side_by_side(str, [])) == []
