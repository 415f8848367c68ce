"""Hosts killed, cables pulled, bytes damaged, in numbers; a case that breaks a rule ends it with its name.

``python -m benchmarks.machine_faults [--kills 200] [--damaged 10000] [--seed 0]`` prints a Markdown table.
Time is simulated (emulated controller, link of 115 200 baud), so the bounds do not depend on this computer.
What is checked: ``tests/rigs/harm_cases.py``.
"""

from __future__ import annotations

import argparse
import random
from collections import Counter

from tests.rigs.harm_cases import beam_block, damaged, killed, random_harm, tell, unplugged, whole

BLOCKS = 10
START = 1000.0


def row(what: str, total: Counter[str]) -> None:
    """Print a line of the table."""
    names = ("complete", "fault", "unfinished", "no journal", "a block in doubt")
    missed = sum(count for name, count in total.items() if name.endswith("not noticed"))
    cells = [what, str(total["runs"]), *(str(total[name]) for name in names), str(missed)]
    print("| " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    """Run the cases and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--damaged", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = random.Random(options.seed)  # noqa: S311  not for secrets
    run = whole()
    print("| what | runs | complete | fault | unfinished | no journal | in doubt | not noticed |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    total: Counter[str] = Counter()
    for _ in range(options.kills):
        after = rng.uniform(0.0, run.ended - START)
        total += tell(lambda after=after: killed(after), f"killed after {after:.6f} s")
    row("host killed at random instants", total)
    total = Counter()
    for number in range(BLOCKS):
        for at in beam_block(run, number):
            total += tell(lambda at=at: unplugged(at), f"unplugged at byte {at}")
    row(f"unplugged at every byte of {BLOCKS} beam blocks", total)
    total = Counter()
    for number in range(1, options.damaged + 1):
        harm = random_harm(rng, run)
        total += tell(lambda harm=harm: damaged(harm), str(harm))
        if number % 1000 == 0:
            row(f"a byte damaged, {number} of {options.damaged}", total)


if __name__ == "__main__":
    main()
