"""``blossom rigs``: list, show, check and probe."""

from __future__ import annotations

import json
import tomllib
from importlib import resources
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rigs.emulator import start_emulator
from rigs.errors import ProfileError
from rigs.rig import load_rig, rig_mistakes, rig_names
from rigs.rig_facts import rig_facts
from studio.cli import main

TEXT = (resources.files("rigs") / "profiles" / "grbl-4axis.toml").read_text("utf-8")


def said(capsys, *words: str, code: int = 0) -> str:
    assert main(["rigs", *words]) == code
    return capsys.readouterr().out


def test_list_is_what_stands_without_words(capsys):
    assert said(capsys) == said(capsys, "list")
    assert [row["name"] for row in json.loads(said(capsys, "--json"))["rigs"]] == list(rig_names())


@pytest.mark.parametrize("name", rig_names())
def test_shipped_rigs_have_no_mistake_and_agree_with_their_emulator(name, capsys):
    assert f"{name}: no mistake found" in said(capsys, "check", name)
    assert f"agrees with {name}" in said(capsys, "probe", name, "--port", "emulator")
    shown = json.loads(said(capsys, "show", name, "--json"))
    assert shown["sha256"] == load_rig(name).sha256 and shown["rig"]["rig"]["name"] == name
    text = said(capsys, "show", name)
    assert "[laser]" in text and "[rotary]" in text and shown["sha256"] in text


def test_check_names_every_mistake(tmp_path, capsys):
    file = tmp_path / "mine.toml"
    file.write_text(
        TEXT.replace("cap_fraction = 0.95", "cap_fraction = 2").replace("settle_s = 0.5", "settle_s = -1.0")
    )
    out = said(capsys, "check", str(file), code=1)
    assert "$.laser.cap_fraction: expected above 0 up to 1, got 2" in out
    assert "$.rotary.settle_s: must not be negative" in out and "2 mistakes" in out
    found = json.loads(said(capsys, "check", str(file), "--json", code=1))
    assert len(found["mistakes"]) == 2 and found["facts"] == {}


def test_probe_names_what_differs(capsys):
    with start_emulator(settings={32: 0, 110: 5000}) as machine:
        out = said(capsys, "probe", "grbl-4axis", "--port", machine.url, code=1)
    assert "setting $32 of the controller is 0" in out and "setting $110" in out
    assert "2 differences" in out and out.startswith("EMULATED")


def test_probe_of_a_port_that_is_not_there(capsys):
    assert main(["rigs", "probe", "grbl-4axis", "--port", "/dev/no-such-port"]) == 3
    assert "/dev/no-such-port" in capsys.readouterr().err


@pytest.mark.parametrize(
    "line", ["show", "check", "probe", "check nope", "list grbl-4axis", "show grbl-4axis --port x", "tell me"]
)
def test_mistakes_in_usage(line, capsys):
    assert main(["rigs", *line.split()]) == 2
    assert capsys.readouterr().err.startswith("error: ")


def test_facts_of_the_four_axis_rig():
    facts = rig_facts(load_rig("grbl-4axis"))
    assert facts["swing_mm"] == pytest.approx(150.0, abs=1e-3)
    assert facts["swing_mm"] < facts["room_under_mm"] < facts["room_over_mm"]
    assert facts["focus_needed_mm"] <= facts["focus_travel_mm"]
    assert facts["largest_w"] == pytest.approx(19.0) and 500.0 < facts["largest_s"] < 1000.0


def places(value: object, path: str) -> list[str]:
    if isinstance(value, dict):
        return [p for key, item in value.items() for p in places(item, f"{path}.{key}")]
    return [path]


PLACES = [
    p for p in places(tomllib.loads(TEXT), "$") if not p.startswith(("$.grades", "$.controller.expect"))
]


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    place=st.sampled_from(PLACES), value=st.sampled_from(["{ x = 1 }", "nan", "-1e300", "[]", '"?"', "inf"])
)
def test_a_wrong_value_anywhere_is_named_with_its_place(tmp_path: Path, place: str, value: str):
    """Each value in turn replaced by nonsense: a mistake that names the place (or one that hangs on it)."""
    section, _, key = place.removeprefix("$.").rpartition(".")
    lines, inside = [], section == ""
    for line in TEXT.splitlines():
        if line.startswith("["):
            inside = line.strip() == f"[{section}]"
        if inside and line.split("=")[0].strip() == key.split(".")[0] and not line.startswith("#"):
            line = f"{key.split('.')[0]} = {value}"
        lines.append(line)
    if lines == TEXT.splitlines():
        return  # a value inside an inline table
    file = tmp_path / "mine.toml"
    file.write_text("\n".join(lines) + "\n")
    try:
        mistakes = rig_mistakes(str(file))
    except ProfileError as error:
        mistakes = (str(error),)
    free = (
        "$.rig.name",
        "$.rig.notes",
        "$.controller.url",
        "$.sheet.material",
        "$.clear.bed_z_mm",
        "$.controller.g54_mm",
    )
    if not mistakes:
        assert place in free or value in ("[]", '"?"', "-1e300"), (place, value)
    assert all(m.startswith("$") for m in mistakes), mistakes
