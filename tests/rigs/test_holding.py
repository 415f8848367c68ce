"""Held and going on: dark while it stands, ``~`` only after a person's word, armed again where needed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from rigs.emulator.outside import turn_door
from rigs.errors import JobError, MachineError
from rigs.gate import Gate
from rigs.holding import Held, Holding
from rigs.replay_checks import Certificate
from tests.rigs.fault_runs import Outcome, check_union, same, simulated, strokes, wanted_strokes
from tests.rigs.harm_cases import JOB, PLAN
from tests.rigs.replay_jobs import RIG
from tests.rigs.simulated_link import SimulatedLink

CERTIFICATE = Certificate("pass", PLAN.sha256, PLAN.rig_sha256, PLAN.material_sha256)
START = 1000.0
WHOLE = wanted_strokes(JOB, range(len(JOB.blocks)))
LIT = [1.9, 2.35, 2.7, 5.6, 9.0]
"""Instants in a cut and in strokes; the rest of INSTANTS is dark."""
INSTANTS = [1.2, *LIT, 5.9, 7.3, 9.9, 12.6]


class Person:
    """Lets the machine go on after some time, and arms it again."""

    def __init__(self, after_s: float = 5.0, says: bool = True, arms: bool = True) -> None:
        self.after_s, self.says, self.arms = after_s, says, arms
        self.links: list[SimulatedLink] = []
        self.seen: list[Held] = []
        self.armed: list[float] = []
        self.told: list[float] = []
        self.questions: list[str] = []
        self.does: Callable[[SimulatedLink], None] = lambda _link: None
        self.holding = Holding(self.go_on, self.arm_again)

    def go_on(self, held: Held) -> bool:
        link = self.links[0]
        self.seen.append(held)
        self.does(link)
        link.run_to(link.clock.now + self.after_s)
        self.told.append(link.clock.now)
        return self.says

    def arm_again(self, question: str) -> bool:
        self.questions.append(question)
        self.armed.append(self.links[0].clock.now)
        return self.arms

    def run(
        self, folder: Path, seconds: float, act: Callable[[SimulatedLink], None], real: bool = True, **more
    ) -> Outcome:
        def prepare(link: SimulatedLink) -> None:
            self.links.append(link)
            link.events.append((START + seconds, act))

        if real:
            more |= {"url": "/dev/ttyUSB9", "certificate": CERTIFICATE, "confirm": lambda _text: True}
            more |= {"ask": lambda _question: True}
        return simulated(PLAN, folder / "first.jsonl", prepare=prepare, holding=self.holding, **more)

    def request(self, _link: SimulatedLink) -> None:
        self.holding.request.set()


def tildes(run: Outcome) -> list[float]:
    return [t for t, byte in run.link.sent if byte == ord("~")]


def burnt(run: Outcome) -> list[tuple[float, ...]]:
    """Strokes that were burnt; the parts of one that was held in the middle are joined."""
    out: list[tuple[float, ...]] = []
    for s in strokes(run):
        before = out[-1] if out else s
        way, last = ([b - a for a, b in zip(x[:3], x[3:6], strict=True)] for x in (s, before))
        onward = sum(a * b for a, b in zip(way, last, strict=True)) > 0.0
        if out and onward and same(before[3:], (*s[:3], s[6])):
            out[-1] = (*before[:3], *s[3:])
        else:
            out.append(s)
    return out


def of_kind(run: Outcome, kind: str) -> list[dict]:
    assert run.journal is not None
    return [r for r in run.journal.records if r["kind"] == kind]


def dark_between(run: Outcome, a: float, b: float) -> bool:
    return not [r for r in run.lit if r["t1"] > a and r["t0"] < b]


@pytest.mark.parametrize("seconds", INSTANTS)
def test_held_on_request_and_going_on(tmp_path, seconds):
    person = Person()
    run = person.run(tmp_path, seconds, person.request)
    assert run.error is None, run.error
    assert len(person.seen) == 1 and person.seen[0].reason == "on request"
    assert tildes(run) and min(tildes(run)) >= person.told[0]
    asked = person.told[0] - person.after_s
    assert dark_between(run, asked, person.told[0])
    assert asked - START - seconds < 0.5
    assert not person.questions  # a short hold: the word to go on is enough
    assert all(same(a, b) for a, b in zip(burnt(run), WHOLE, strict=True))
    (held,), (released,) = of_kind(run, "held"), of_kind(run, "released")
    assert held["n"] < released["n"] and released["lapsed"] == ""
    assert 5.0 <= released["held_s"] < 6.0


@pytest.mark.parametrize("seconds", LIT)
def test_light_is_off_soon_after_the_request(tmp_path, seconds):
    person = Person()
    run = person.run(tmp_path, seconds, person.request)
    before = [r["t1"] for r in run.lit if r["t0"] < person.told[0]]
    assert max(before) - START - seconds <= 0.15


def test_without_a_word_to_go_on_it_stops(tmp_path):
    person = Person(says=False)
    run = person.run(tmp_path, 2.7, person.request)
    assert isinstance(run.error, JobError) and "stopped while held in block 5" in str(run.error)
    assert not tildes(run)
    assert run.journal is not None and run.journal.outcome == "stopped"
    assert dark_between(run, START + 2.9, 1e9)
    check_union(JOB, run, tmp_path)


@pytest.mark.parametrize("arms", [True, False])
def test_a_long_hold_is_armed_again(tmp_path, arms):
    person = Person(after_s=RIG.safety.arm_timeout_s + 1.0, arms=arms)
    run = person.run(tmp_path, 2.7, person.request)
    (question,) = person.questions
    assert "arm REAL laser grbl-4axis" in question and PLAN.sha256[:12] in question and "19 W" in question
    if arms:
        assert run.error is None, run.error
        assert min(tildes(run)) >= person.armed[0]
        assert "longer than 120 s" in of_kind(run, "released")[0]["lapsed"]
        assert all(same(a, b) for a, b in zip(burnt(run), WHOLE, strict=True))
    else:
        assert isinstance(run.error, JobError) and "not armed" in str(run.error)
        assert not tildes(run) and dark_between(run, START + 2.9, 1e9)


def door_byte(link: SimulatedLink) -> None:
    link.machine.receive(b"\x84")


def door_pin(link: SimulatedLink) -> None:
    turn_door(link.machine, is_open=True)


def other_hold(link: SimulatedLink) -> None:
    link.machine.receive(b"!")


@pytest.mark.parametrize("seconds", [1.2, 2.7, 5.6, 7.3, 12.6])
@pytest.mark.parametrize("act", [door_byte, door_pin, other_hold])
def test_door_and_foreign_holds_are_armed_again(tmp_path, act, seconds):
    """T6: after door byte, door pin and closing, or a hold from elsewhere: no ``~`` without arming."""
    person = Person(after_s=2.0)
    if act is door_pin:
        person.does = lambda link: turn_door(link.machine, is_open=len(person.seen) < 2)
    run = person.run(tmp_path, seconds, act)
    assert run.error is None, run.error
    assert len(person.questions) == 1
    assert len(tildes(run)) == 1 and tildes(run)[0] >= person.armed[0] >= person.told[-1]
    assert dark_between(run, person.told[0] - 2.0, person.armed[0])
    assert all(same(a, b) for a, b in zip(burnt(run), WHOLE, strict=True))
    if act is door_pin:
        assert [h.lid_open for h in person.seen] == [True, True]  # asked again: it was still open
        assert "close the lid" in person.seen[0].words


def test_the_door_of_a_machine_that_nobody_arms_again_stays_dark(tmp_path):
    person = Person(arms=False)
    person.does = lambda link: turn_door(link.machine, is_open=False)
    run = person.run(tmp_path, 2.7, door_pin)
    assert isinstance(run.error, JobError)
    assert not tildes(run) and dark_between(run, START + 2.9, 1e9)


def test_a_machine_that_leaves_the_hold_alone_is_stopped(tmp_path):
    """Somebody else presses cycle start while the person here has not decided: the answer comes too late."""
    person = Person(after_s=0.4)
    person.does = lambda link: link.machine.receive(b"~")
    run = person.run(tmp_path, 2.7, person.request)
    assert isinstance(run.error, MachineError) and "left the hold by itself" in str(run.error)
    assert not tildes(run)


def test_a_power_cycle_while_held_is_a_fault(tmp_path):
    person = Person()
    person.does = lambda link: link.machine.power_cycle()
    run = person.run(tmp_path, 2.7, person.request)
    assert isinstance(run.error, MachineError) and "restarted in the middle" in str(run.error)
    assert not tildes(run)
    check_union(JOB, run, tmp_path)


def test_a_clock_that_jumps_while_held_disarms(tmp_path):
    person = Person(after_s=1.0)

    def sleeps(link: SimulatedLink) -> None:
        link.clock.jump = 600.0

    person.does = sleeps
    run = person.run(tmp_path, 2.7, person.request)
    assert run.error is None
    assert len(person.questions) == 1
    assert of_kind(run, "released")[0]["lapsed"] == "the clock jumped"


def test_twice_and_a_dry_run(tmp_path):
    for number, more in enumerate(({"watched": False}, {"watched": True})):
        place = tmp_path / str(number)
        place.mkdir()
        person = Person(after_s=1.0)
        run = person.run(place, 1.5, person.request, real=False, mode="dry-run", **more)
        assert run.error is None, run.error
        assert len(person.seen) == 1 and len(tildes(run)) == 1
        assert not run.lit and not person.questions


def test_a_stop_while_held(tmp_path):
    person = Person()

    def interrupt(_link: SimulatedLink) -> None:
        raise KeyboardInterrupt

    person.does = interrupt
    run = person.run(tmp_path, 2.7, person.request)
    assert isinstance(run.error, KeyboardInterrupt)
    assert not tildes(run) and dark_between(run, START + 2.9, 1e9)
    assert run.journal is not None and run.journal.outcome == "stopped"


def test_the_gate_passes_the_word_to_go_on_only_after_a_hold_and_a_raised_level():
    class Tape:
        def __init__(self) -> None:
            self.data = b""

        def write(self, data: bytes) -> None:
            self.data += data

        urgent = write

    tape = Tape()
    gate = Gate(tape, RIG)
    for level in ("quiet", "motion", "pilot", "armed", "held"):
        gate.level = level
        with pytest.raises(JobError, match="a person has to let it go on"):
            gate.go_on()
    gate.level = "armed"
    gate.hold()
    with pytest.raises(JobError, match="a person has to let it go on"):
        gate.go_on()
    for line in ("G1X1F60", "M4S0", "M3", "G0A1", "G1X1S5"):
        with pytest.raises(JobError):
            gate.send((line, "M5"))
    gate.level = "armed"
    gate.go_on()
    with pytest.raises(JobError, match="a person has to let it go on"):
        gate.go_on()
    gate.hold()
    gate.stop()
    gate.level = "armed"
    with pytest.raises(JobError, match="a person has to let it go on"):
        gate.go_on()
    assert tape.data == b"!~!!\x18"
