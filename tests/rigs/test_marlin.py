"""Marlin as a dialect: each line once and in order, however many are damaged; light stays behind the gate."""

from __future__ import annotations

import dataclasses

import msgspec
import pytest

from rigs.block_writer import gcode_style
from rigs.dialects import DIALECTS, dialect_mistake, spoken_dialect
from rigs.emulator import start_emulator
from rigs.errors import JobError, MachineError
from rigs.marlin import MarlinLink, marlin_line
from rigs.probe import probe
from rigs.profile_writer import profile_toml
from rigs.replay import replay
from rigs.replay_blocks import lit_block, replay_job
from rigs.replay_checks import Certificate
from rigs.rig_checks import mistakes
from tests.rigs.fault_runs import fault_job
from tests.rigs.marlin_peer import INFO, Marlin, serve
from tests.rigs.replay_jobs import RIG

EXPECT = {"$100": 80.0, "$101": 80.0, "$102": 400.0, "$103": 88.89, "$110": 12000.0, "$120": 2000.0}
CONTROLLER = msgspec.structs.replace(
    RIG.controller, dialect="marlin", g54_mm=(), expect=EXPECT, homing="none", rx_bytes=512
)
MARLIN = msgspec.structs.replace(
    RIG, controller=CONTROLLER, safety=msgspec.structs.replace(RIG.safety, status_lost_s=3.0)
)


def job():
    made = fault_job()
    return replay_job(
        dataclasses.replace(made, style=gcode_style(MARLIN), hashes={**made.hashes, "rig": MARLIN.sha256})
    )


def expected(plan) -> list[str]:
    lines, motion = [], 0.0
    for block in plan.blocks:
        for line in lit_block(block):
            made, motion = marlin_line(line, motion)
            lines.append(made)
    return [line for line in lines if line]


def test_the_profile_has_no_mistake():
    assert list(mistakes(MARLIN)) == []
    quick = msgspec.structs.replace(MARLIN, safety=RIG.safety)
    assert any("busy every 2 s" in text for text in mistakes(quick))


@pytest.mark.parametrize(
    ("line", "made"),
    [
        ("G1X206Y145F1200S500", "G1 X206 Y145 F1200 S500"),
        ("X206Y155", "G1 X206 Y155"),
        ("G4P0.01", "G4 P10"),
        ("M4S0", "M4 I S0"),
        ("M5 S0", "M5"),
        ("G94", ""),
        ("M2", ""),
        ("G0A-180.5", "G0 A-180.5"),
    ],
)
def test_lines_in_marlin(line, made):
    assert marlin_line(line, 1.0)[0] == made


def test_a_look_says_what_it_is():
    with serve(Marlin()) as url:
        found = probe(url, MARLIN)
    assert found.mistakes == ()
    assert found.status.work == (0.0, 0.0, 0.0, 0.0)
    assert not found.identity.emulated


@pytest.mark.parametrize("damage", [0.0, 0.05, 0.2])
def test_each_line_once_in_order(tmp_path, damage):
    """A fifth of all lines damaged on the way: asked for again, executed once."""
    plan = job()
    marlin = Marlin(damage=damage, seed=5)
    certificate = Certificate("pass", plan.sha256, MARLIN.sha256, plan.material_sha256)
    with serve(marlin) as url:
        journal = replay(
            plan, url, rig=MARLIN, journal_path=tmp_path / "j", mode="arm", certificate=certificate,
            confirm=lambda _text: True, ask=lambda _text: True, grace_s=5.0,
        )  # fmt: skip
    assert journal.outcome == "complete"
    assert marlin.done[1:] == expected(plan)  # the first is M5
    assert marlin.done[0] == "M5"
    assert (marlin.asked_again > 0) == (damage > 0.0)


def test_a_dry_run_has_no_light(tmp_path):
    marlin = Marlin()
    with serve(marlin) as url:
        replay(job(), url, rig=MARLIN, journal_path=tmp_path / "j", grace_s=5.0)
    assert not [line for line in marlin.done if line.startswith(("M3", "M4"))]
    assert not [line for line in marlin.done if " S" in line and not line.endswith("S0")]


def test_a_lost_link_ends_the_job(tmp_path):
    def cut(line: str) -> None:
        if line.startswith("G1 X204"):
            raise ConnectionAbortedError

    plan, marlin = job(), Marlin(at_line=cut)
    certificate = Certificate("pass", plan.sha256, MARLIN.sha256, plan.material_sha256)
    with serve(marlin) as url, pytest.raises(MachineError, match="vanished"):
        replay(
            plan, url, rig=MARLIN, journal_path=tmp_path / "j", mode="arm", certificate=certificate,
            confirm=lambda _text: True, ask=lambda _text: True, grace_s=5.0,
        )  # fmt: skip


def test_a_machine_that_answers_no_more_is_killed(tmp_path):
    plan, marlin = job(), Marlin()

    def go_awol(line: str) -> None:
        if line.startswith("G1 X204"):
            marlin.answers = lambda _data: ""  # type: ignore[method-assign]

    marlin.at_line = go_awol
    certificate = Certificate("pass", plan.sha256, MARLIN.sha256, plan.material_sha256)
    with serve(marlin) as url, pytest.raises(MachineError):
        replay(
            plan, url, rig=MARLIN, journal_path=tmp_path / "j", mode="arm", certificate=certificate,
            confirm=lambda _text: True, ask=lambda _text: True, grace_s=1.0,
        )  # fmt: skip
    assert b"\nM112\n" in bytes(marlin.raw)
    assert bytes(marlin.raw).split(b"M112", 1)[1].count(b"M4") == 0


def test_a_marlin_without_emergency_parser_is_not_armed(tmp_path):
    with serve(Marlin(info=INFO.replace("EMERGENCY_PARSER:1", "EMERGENCY_PARSER:0"))) as url:
        found = probe(url, MARLIN)
    assert any("EMERGENCY_PARSER" in text for text in found.mistakes)


def test_a_request_for_a_line_that_is_gone_is_a_fault():
    class Wire:
        url = "here"

        def write(self, data: bytes) -> None:
            self.data = data

        def read_line(self, _timeout_s: float) -> bytes | None:
            return b"Resend: 900"

    link = MarlinLink(Wire(), MARLIN)  # type: ignore[arg-type]
    with pytest.raises(MachineError, match="asks for line 900 again"):
        link.read_line(0.1)


def test_a_block_that_does_not_fit_with_its_numbers_is_refused():
    class Wire:
        url = "here"

    small = msgspec.structs.replace(CONTROLLER, rx_bytes=64)
    link = MarlinLink(Wire(), msgspec.structs.replace(MARLIN, controller=small))  # type: ignore[arg-type]
    with pytest.raises(JobError, match="does not fit the receive buffer"):
        link.write(b"M4S0\nG1X206.123Y145.456F1200S500\nM5\nG4P0.01\n")


SAID = {
    "grbl1.1": ("[VER:1.1h.20190830:]", "[OPT:V,15,128]"),
    "grbl-mega-5x": ("[VER:1.1q.20230611:]", "[OPT:VNMGH,35,255,48]", "[AXS:4:XYZA]"),
    "grblhal": ("[VER:1.1f.20240222:]", "[OPT:VNMSL,100,1024,3,0]", "[AXS:4:XYZA]", "[FIRMWARE:grblHAL]"),
    "fluidnc": ("[VER:3.7 FluidNC v3.7.8:]", "[OPT:PHSW]"),
    "marlin": ("[FIRMWARE_NAME:Marlin 2.1.2.4 (Jan 1 2024)]", "[Cap:EMERGENCY_PARSER:1]"),
}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_every_firmware_is_told_from_every_other(dialect):
    assert spoken_dialect(SAID[dialect]) == dialect
    for other in DIALECTS:
        mistake = dialect_mistake(other, SAID[dialect])
        assert (mistake is None) == (other == dialect)
        assert mistake is None or f"speaks {dialect}, the profile says {other}" in mistake
    assert "does not say what it is" in str(dialect_mistake(dialect, ("hello",)))


def test_an_emulated_fluidnc(tmp_path):
    """The same driver, another answer to ``$I``: its job runs, another profile is refused."""
    fluid = msgspec.structs.replace(
        RIG, controller=msgspec.structs.replace(RIG.controller, dialect="fluidnc")
    )
    path = tmp_path / "fluid.toml"
    path.write_text(profile_toml(fluid))
    plan = replay_job(fault_job(fluid))
    with start_emulator(path) as machine:
        assert probe(machine.url, fluid).mistakes == ()
        other = probe(machine.url, RIG).mistakes
        done = replay(plan, machine.url, rig=fluid, journal_path=tmp_path / "j", mode="arm", grace_s=5.0)
    assert done.outcome == "complete"
    assert other[0].startswith("the controller speaks fluidnc, the profile says grbl-mega-5x")
