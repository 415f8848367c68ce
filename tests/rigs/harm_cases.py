"""Cases of harm: the host killed, the cable off at a byte, a byte damaged; each checked, each counted."""

from __future__ import annotations

import random
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rigs.errors import JobError, MachineError
from tests.rigs.fault_runs import (
    Outcome,
    check_end,
    check_light,
    check_union,
    plan_of_fault_job,
    same,
    simulated,
    strokes,
    wanted_strokes,
)
from tests.rigs.simulated_link import Harm

JOB, PLAN = plan_of_fault_job()


@contextmanager
def folder() -> Iterator[Path]:
    made = Path(tempfile.mkdtemp(prefix="harm-"))
    try:
        yield made
    finally:
        shutil.rmtree(made)


def whole() -> Outcome:
    """The run that nothing harms."""
    with folder() as place:
        run = simulated(PLAN, place / "first.jsonl")
    assert run.error is None
    return run


def beam_block(run: Outcome, number: int) -> range:
    """Places, in the bytes that leave the host, of a beam block of a run."""
    t0, block = [(t, b) for t, b in run.begun if b.beam_s > 0.0][number]
    first = next(i for i, (t, byte) in enumerate(run.link.sent) if t >= t0 and byte == ord("M"))
    return range(first, first + sum(len(line) + 1 for line in block.lines))


def killed(after_s: float) -> Counter[str]:
    """The host dies; the machine goes on with what it has."""
    with folder() as place:
        run = simulated(PLAN, place / "first.jsonl", dies_after=after_s)
        _checked(run, place)
        return _counted(run)


def unplugged(at: int) -> Counter[str]:
    """The cable comes off before byte ``at`` of what the host sends; nothing comes back either."""
    with folder() as place:
        run = simulated(PLAN, place / "first.jsonl", harms=[Harm("out", at, "cut")])
        assert isinstance(run.error, MachineError)
        assert run.ended - run.link.cut_at <= 2.0
        _checked(run, place)
        return _counted(run)


def random_harm(rng: random.Random, run: Outcome) -> Harm:
    """One byte of either direction dropped, doubled, changed, or followed by another one."""
    way = rng.choice(("out", "in"))
    kind = rng.choice(("drop", "double", "flip", "add"))
    value = 1 << rng.randrange(8) if kind == "flip" else rng.randrange(256)
    return Harm(way, rng.randrange(run.link._count[way]), kind, value)  # type: ignore[arg-type]


def damaged(harm: Harm) -> Counter[str]:
    """One byte is damaged.

    A machine without checksums can take a damaged line for another good one. What has to hold: no light at
    rest, none outside the time of its block, and every block before the damaged one is as planned. Where the
    damage was not noticed, the count says so.
    """
    with folder() as place:
        run = simulated(PLAN, place / "first.jsonl", harms=[harm])
        assert run.error is None or isinstance(run.error, (MachineError, JobError)), repr(run.error)
        check_light(run)
        check_end(run)
        counts = _counted(run)
        sure = wanted_strokes(JOB, [k for k in run.done if JOB.blocks[k].lit])
        have = strokes(run)
        wrong = [n for n, b in enumerate(sure) if n >= len(have) or not same(have[n], b)]
        if wrong or (run.error is None and len(have) != len(sure)):
            counts["another path, not noticed"] += 1
        elif any(r["s"] != 500.0 for r in run.lit[:-1]) or (run.error is None and run.lit[-1]["s"] != 500.0):
            counts["another power, not noticed"] += 1
        elif any(abs(r["feed"] - 20.0) > 1e-3 for r in run.lit[:-1]):
            counts["another speed, not noticed"] += 1
        return counts


def _checked(run: Outcome, place: Path) -> None:
    check_light(run)
    check_end(run)
    check_union(JOB, run, place)


def _counted(run: Outcome) -> Counter[str]:
    ended = "no journal" if run.journal is None else run.journal.outcome
    return Counter({ended: 1, "a block in doubt": int(run.doubt is not None), "runs": 1})


def tell(case: Callable[[], Counter[str]], what: str) -> Counter[str]:
    """Run a case; a failure names it."""
    try:
        return case()
    except AssertionError as error:
        raise AssertionError(f"{what}: {error}") from error
