"""The table of a setting: against the section model itself, on disk, and as the law of a chain."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigs.material import load_material
from twin import section_table as module
from twin.errors import HeatingError
from twin.pass_law import FastLaw, PassLaw
from twin.process_table import Conditions, SettingTable
from twin.section_law import SectionLaw, section_case
from twin.section_model import SectionCase, section_passes
from twin.section_table import TABLE_PASSES, SectionTable, make_table, section_table

STEEL = load_material("304")
CASE = SectionCase(STEEL, 0.1, 10.0, 200.0, 0.1)
CONDITIONS = Conditions(
    material=STEEL, thickness_mm=0.1, absorptivity=0.35, across_mm=0.06, along_mm=0.05, largest_w=15.0,
    largest_mm_s=400.0, allowed_c=200.0, shortest_wait_s=0.1,
)  # fmt: skip


@pytest.fixture(scope="module")
def table() -> SectionTable:
    return make_table(CASE, 200.0)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "metal-blossom" / "section-tables"


@pytest.mark.parametrize("start_c", [20.0, 47.0, 110.0, 188.0])
def test_chains_are_those_of_the_section_model(table: SectionTable, start_c: float) -> None:
    direct = section_passes([replace(CASE, start_c=start_c)], 60)[0].angle_rad
    found = table.angles(np.full(60, start_c))
    np.testing.assert_allclose(found[:TABLE_PASSES], direct[:TABLE_PASSES], rtol=0.01)
    np.testing.assert_allclose(found, direct, rtol=0.03)
    np.testing.assert_allclose(table.angles(np.full(30, start_c), done=30), found[30:], rtol=1e-12)


@pytest.mark.parametrize("share", [0.3, 0.4, 0.5, 0.62, 0.78, 0.93, 1.0])
def test_weaker_passes_are_those_of_the_section_model(table: SectionTable, share: float) -> None:
    direct = section_passes([replace(CASE, power_w=share * CASE.power_w)])[0].angle_rad[0]
    assert table.angle_at_share(share) == pytest.approx(direct, rel=0.03)


def test_no_power_no_angle(table: SectionTable) -> None:
    assert table.angle_at_share(0.0) == 0.0
    assert table.angle_at_share(1.0) == pytest.approx(table.first_rad, rel=1e-12)
    assert table.failures == 0


def test_ten_thousand_passes_are_looked_up_like_one_by_one(table: SectionTable) -> None:
    starts = np.random.default_rng(1).uniform(0.0, 260.0, 10_500)
    found = table.angles(starts)
    assert np.all(np.isfinite(found))
    assert np.all(found > 0.0)
    for n in (0, 1, 17, 39, 40, 41, 500, 10_499):
        assert found[n] == pytest.approx(float(table.angles(starts[n : n + 1], done=n)[0]), rel=1e-12)


def _same(a: SectionTable, b: SectionTable) -> bool:
    names = ("start_c", "angle_rad", "power_share", "power_rad")
    return a.failures == b.failures and all(np.array_equal(getattr(a, n), getattr(b, n)) for n in names)


def test_a_table_is_kept_and_read_back_the_same(
    table: SectionTable, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[SectionCase] = []

    def counted(case: SectionCase, hottest_c: float) -> SectionTable:
        made.append(case)
        return table

    monkeypatch.setattr(module, "make_table", counted)
    first = section_table(CASE, 200.0)
    again = section_table(replace(CASE, start_c=90.0), 200.0)
    assert len(made) == 1
    assert _same(first, again)
    (file,) = cache.iterdir()
    for other in (
        replace(CASE, power_w=10.5), replace(CASE, speed_mm_s=201.0), replace(CASE, spot_mm=0.11),
        replace(CASE, tilt_rad=0.1), replace(CASE, thickness_mm=0.11), replace(CASE, absorptivity=0.3),
        replace(CASE, material=load_material("316")), replace(CASE, moment_n=0.01),
        replace(CASE, material=STEEL.with_temper("full-hard")),
    ):  # fmt: skip
        section_table(other, 200.0)
    section_table(CASE, 150.0)
    assert len(made) == 11
    assert len(list(cache.iterdir())) == 11
    assert file.exists()


@given(data=st.data())
@settings(max_examples=25)
def test_a_damaged_file_is_made_anew(
    table: SectionTable, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = tmp_path_factory.mktemp("tables")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "make_table", lambda case, hottest_c: table)
        section_table(CASE, 200.0, folder=folder)
        (file,) = folder.iterdir()
        whole = file.read_bytes()
        place = data.draw(st.integers(0, len(whole) - 1))
        kind = data.draw(st.sampled_from(["cut", "flip", "text", "list"]))
        flipped = bytes([whole[place] ^ 1])
        broken = {
            "cut": whole[:place], "flip": whole[:place] + flipped + whole[place + 1 :],
            "text": b"\xff not JSON", "list": b"[]",
        }[kind]  # fmt: skip
        file.write_bytes(broken)
        assert _same(section_table(CASE, 200.0, folder=folder), table)
        after = json.loads(file.read_bytes())
        assert after["table"] == json.loads(whole)["table"]


def test_a_folder_that_cannot_be_written_does_no_harm(
    table: SectionTable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "make_table", lambda case, hottest_c: table)
    (tmp_path / "file").write_text("in the way")
    assert _same(section_table(CASE, 200.0, folder=tmp_path / "file" / "tables"), table)


def test_a_hottest_start_must_be_warm() -> None:
    for hottest in (20.0, float("nan"), -5.0):
        with pytest.raises(HeatingError, match="hottest start"):
            make_table(CASE, hottest)


def test_both_laws_do_in_a_chain(cache: Path) -> None:
    fast, section = SettingTable(CONDITIONS), SettingTable(CONDITIONS, "section")
    angle = np.radians(20.0)
    chains = [t.best(angle, 10.0) for t in (fast, section)]
    laws: list[PassLaw] = [c.law for c in chains]
    assert isinstance(laws[0], FastLaw)
    assert isinstance(laws[1], SectionLaw)
    assert chains[0].power_w == chains[1].power_w
    for chain in chains:
        schedule = chain.schedule(angle, 0.1)
        assert sum(schedule.increments_rad) == pytest.approx(angle, rel=1e-6)
        assert schedule.power_w <= chain.power_w * (1.0 + 1e-12)
        assert chain.first_rad_at(chain.power_for(0.8 * chain.first_rad)) == pytest.approx(
            0.8 * chain.first_rad, rel=1e-9
        )
        split = np.concatenate([chain.factors(np.full(5, 60.0)), chain.factors(np.full(7, 60.0), 5)])
        np.testing.assert_allclose(split, chain.factors(np.full(12, 60.0)), rtol=1e-12)
    assert any("power law" in flag for flag in chains[1].flags_after(TABLE_PASSES + 1))
    assert not any("power law" in flag for flag in chains[1].flags_after(TABLE_PASSES))


def test_footprints_become_round_beams_that_lean_across() -> None:
    leaning = section_case(CONDITIONS, 10.0, 200.0)
    assert leaning.spot_mm == pytest.approx(0.1)
    assert 0.5 * leaning.spot_mm / np.cos(leaning.tilt_rad) == pytest.approx(0.06)
    along = section_case(replace(CONDITIONS, across_mm=0.05, along_mm=0.08), 10.0, 200.0)
    assert along.tilt_rad == 0.0
    assert along.spot_mm == pytest.approx(2.0 * np.sqrt(0.05 * 0.08))
