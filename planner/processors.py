"""How many processors there are to use, and work on several of them."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

__all__ = ["processors", "side_by_side"]

Item = TypeVar("Item")
Result = TypeVar("Result")


def processors() -> int:
    """How many processors this process may use."""
    usable = getattr(os, "sched_getaffinity", None)
    return len(usable(0)) if usable else os.cpu_count() or 1


def side_by_side(function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Results of ``function`` in the order of the items, worked out by one thread for each processor.

    Threads help as far as the function runs without the interpreter lock, as kernels do. No more items are
    taken ahead than there are processors, so whoever stops asking wastes little.
    """
    waiting: deque[Future[Result]] = deque()
    many = processors()
    with ThreadPoolExecutor(many) as pool:
        try:
            for item in items:
                waiting.append(pool.submit(function, item))
                if len(waiting) == many:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()
