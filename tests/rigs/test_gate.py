"""The gate: what may pass at each level, checked against a slow reading of the same lines."""

from __future__ import annotations

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs.errors import JobError
from rigs.gate import Gate, split_words
from rigs.rig import load_rig
from tests.rigs.replay_jobs import RIG


class Wire:
    """A link that keeps what is written."""

    def __init__(self) -> None:
        self.data = b""

    def write(self, data: bytes) -> None:
        self.data += data

    urgent = write


def gate(level: str, rig: str = "grbl-4axis") -> tuple[Gate, Wire]:
    wire = Wire()
    made = Gate(wire, load_rig(rig))  # type: ignore[arg-type]
    made.level = level  # type: ignore[assignment]
    return made, wire


BEAM = ("M4S0", "G1X5F600S500", "M5")


@pytest.mark.parametrize("level", ["quiet", "motion", "pilot"])
@pytest.mark.parametrize(
    "lines",
    [BEAM, ("M3",), ("M4S0", "M5"), ("S1",), ("G1X1F5S0.5",), ("m4", "m5"), ("G0X1M3",), ("M04", "M5"),
     ("$H",), ("$X",), ("$J=G91X1F5",), ("$32=0",), ("~",), ("G1 X1 (M4) M3", "M5")],
)  # fmt: skip
def test_nothing_that_can_light_passes_before_arming(level: str, lines: tuple[str, ...]) -> None:
    made, wire = gate(level)
    with pytest.raises(JobError):
        made.send(lines)
    assert wire.data == b""


def test_armed_gate_passes_a_block_that_ends_dark_and_nothing_else() -> None:
    made, wire = gate("armed")
    assert made.send(BEAM) == 3
    assert wire.data == b"M4S0\nG1X5F600S500\nM5\n"
    for lines, words in [
        (BEAM[:2], "ends with the light on"),
        (("M3S500", "G1X5", "M5"), "only M4"),
        (("M4", "G1X5A90F5S5", "M5"), "turns the rotary with the light on"),
        (("M4", "G1X5F5S953", "M5"), "at most S951.9"),
        (("M4", "G1X5F5S-1", "M5"), "at most S951.9"),
        (("G91", "G0X5"), "absolute"),
        (("G92X0",), "offsets"),
        (("G10L2P1X0",), "offsets"),
        (("G1X5F5\nM4S500",), "printable"),
        (("G1X5é",), "printable"),
        (("G1X1e5",), "not plain"),
        (("G1Xnan",), "not plain"),
        (("G1 X1 " + "Y" + "1" * 99,), "characters"),
        (("G1X1F5",) * 40, "does not fit the receive buffer"),
    ]:
        with pytest.raises(JobError, match=words):
            made.send(lines)
    assert wire.data == b"M4S0\nG1X5F600S500\nM5\n"


def test_quiet_gate_passes_questions_and_darkness_only() -> None:
    made, wire = gate("quiet")
    for question in ("$I", "$$", "$#", "$G"):
        made.ask(question)
    made.ask_status()
    made.dark()
    made.send(("M5 S0",))
    assert wire.data == b"$I\n$$\n$#\n$G\n?M5\nM5 S0\n"
    for question in ("$H", "$X", "$C", "$RST=*"):
        with pytest.raises(JobError):
            made.ask(question)
    with pytest.raises(JobError, match="before it is checked"):
        made.send(("G0X1",))
    with pytest.raises(JobError, match="motion level"):
        made.home()


def test_stop_ends_the_armed_state() -> None:
    made, wire = gate("armed")
    made.stop()
    assert wire.data == b"!\x18"
    with pytest.raises(JobError):
        made.send(BEAM)


def test_pilot_gate_passes_the_pilot_power_and_no_more() -> None:
    made, _ = gate("pilot")
    made.send(("M8", "G1X5F600", "M9"))
    pilot = msgspec.structs.replace(RIG.laser.pilot, kind="low-power", s=5.0)
    laser = msgspec.structs.replace(RIG.laser, pilot=pilot)
    wire = Wire()
    low = Gate(wire, msgspec.structs.replace(RIG, laser=laser))  # type: ignore[arg-type]
    low.level = "pilot"
    low.send(("M3 S5", "G1X5F600", "M5"))
    with pytest.raises(JobError, match="at most S5"):
        low.send(("M3 S6", "G1X5F600", "M5"))
    low.level = "motion"
    with pytest.raises(JobError):
        low.send(("M3 S5", "G1X5F600", "M5"))


WORDS = st.lists(
    st.tuples(st.sampled_from("GMXYZAFSP"), st.floats(-1000, 1000).map(lambda v: round(v, 3))), max_size=6
)


@given(st.lists(WORDS, min_size=1, max_size=4))
def test_lines_that_pass_unarmed_never_light(lines: list[list[tuple[str, float]]]) -> None:
    made, wire = gate("motion")
    texts = ["".join(f"{letter}{value:.3f}" for letter, value in words) for words in lines]
    try:
        made.send(texts)
    except JobError:
        assert wire.data == b""
        return
    for words in lines:
        assert ("M", 3.0) not in words
        assert ("M", 4.0) not in words
        assert all(value <= 0.0 for letter, value in words if letter == "S")


@given(WORDS)
def test_words_are_read_back(words: list[tuple[str, float]]) -> None:
    text = " ".join(f"{letter.lower()} {value:.3f}" for letter, value in words)
    assert split_words(text + " (S999) ; M3") == [(letter, float(f"{value:.3f}")) for letter, value in words]
