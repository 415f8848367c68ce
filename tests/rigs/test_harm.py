"""Killed hosts, pulled cables and damaged bytes: dark in time, one block in doubt at most, each pass once.

Simulated time, so every bound is exact. The long forms are ``slow``; ``benchmarks/machine_faults.py``
prints their table.
"""

from __future__ import annotations

import random
from collections import Counter

import pytest

from tests.rigs.harm_cases import beam_block, damaged, killed, random_harm, tell, unplugged, whole


@pytest.fixture(scope="module")
def run():
    return whole()


def kills(run, count: int, seed: int) -> Counter[str]:
    rng = random.Random(seed)  # noqa: S311  not for secrets
    length = run.ended - 1000.0
    total: Counter[str] = Counter()
    for _ in range(count):
        after = rng.uniform(0.0, length)
        total += tell(lambda after=after: killed(after), f"killed after {after:.6f} s")
    return total


def test_a_host_killed_at_random_instants(run):
    total = kills(run, 15, 1)
    assert total["unfinished"] + total["no journal"] == 15


def test_the_cable_off_within_a_beam_block(run):
    for number in (1, 5):
        places = beam_block(run, number)
        for at in (*places[::7], places[-1]):
            assert tell(lambda at=at: unplugged(at), f"unplugged at byte {at}")["a block in doubt"] == 1


def test_damaged_bytes(run):
    rng = random.Random(2)  # noqa: S311
    total: Counter[str] = Counter()
    for _ in range(60):
        harm = random_harm(rng, run)
        total += tell(lambda harm=harm: damaged(harm), str(harm))
    assert total["fault"] > 10  # most damage is noticed, and the machine stopped


@pytest.mark.slow
def test_two_hundred_kills(run):
    assert kills(run, 200, 3)["runs"] == 200


@pytest.mark.slow
def test_the_cable_off_at_every_byte_of_every_beam_block(run):
    for number in range(10):
        for at in beam_block(run, number):
            tell(lambda at=at: unplugged(at), f"unplugged at byte {at}")


@pytest.mark.slow
def test_ten_thousand_damaged_bytes(run):
    rng = random.Random(4)  # noqa: S311
    for _ in range(10_000):
        harm = random_harm(rng, run)
        tell(lambda harm=harm: damaged(harm), str(harm))
