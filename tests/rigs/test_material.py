"""Material profiles: what ships is sound, mistakes are named with their place."""

from __future__ import annotations

import math
import tomllib
from importlib import resources

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs.errors import ProfileError, RigError, UnknownNameError
from rigs.material import TABLE_COLUMNS, load_material, material_names, parse_material

SHIPPED = ("1095", "1100", "304", "316", "6061", "mild-steel", "nickel", "titanium-2")


def text_of(name: str) -> str:
    return (resources.files("rigs") / "materials" / f"{name}.toml").read_text("utf-8")


def test_the_shipped_materials():
    assert material_names() == SHIPPED
    hashes = {load_material(name).sha256 for name in SHIPPED}
    assert len(hashes) == len(SHIPPED)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_material_is_physically_sound(name):
    material = load_material(name)
    assert material.name == name
    table = material.table
    assert table.temperature_c[0] == 20.0
    assert table.temperature_c[-1] <= material.constants.solidus_c + 60.0
    assert all(a >= b for a, b in zip(table.young_gpa, table.young_gpa[1:], strict=False))
    assert all(a >= b for a, b in zip(table.yield_mpa, table.yield_mpa[1:], strict=False))
    assert material.yield_pa == pytest.approx(1e6 * table.yield_mpa[0], rel=0.2)
    diffusivity = material.value("conductivity_w_mk", 20) / (
        material.density_kg_m3 * material.value("heat_capacity_j_kgk", 20)
    )
    assert 3e-6 < diffusivity < 1e-4
    assert all(grade.source for grade in material.grades.values())
    for temper in material.temper:
        assert material.with_temper(temper).temper_name == temper


@pytest.mark.parametrize(
    ("temperature_c", "conductivity", "capacity"), [(26.85, 13.8, 483.0), (1000.0, 29.0, 660.0)]
)
def test_316_follows_the_cited_fits(temperature_c, conductivity, capacity):
    material = load_material("316")
    assert material.value("conductivity_w_mk", temperature_c) == pytest.approx(conductivity, rel=0.05)
    assert material.value("heat_capacity_j_kgk", temperature_c) == pytest.approx(capacity, rel=0.05)


@given(st.floats(-200.0, 3000.0), st.sampled_from(TABLE_COLUMNS))
def test_the_table_is_read_as_numpy_interpolates(temperature_c, column):
    material = load_material("304")
    expected = np.interp(temperature_c, material.table.temperature_c, getattr(material.table, column))
    assert material.value(column, temperature_c) == pytest.approx(expected, rel=1e-12)


def test_a_harder_temper_yields_later_until_it_is_annealed():
    soft, hard = load_material("304"), load_material("304/full-hard")
    assert hard.yield_pa > 3 * soft.yield_pa
    assert hard.yield_mpa_at(20.0) == pytest.approx(900.0)
    assert hard.yield_mpa_at(900.0) == soft.yield_mpa_at(900.0)
    assert hard.sha256 != soft.sha256
    values = [load_material("6061/annealed").yield_mpa_at(t) for t in range(0, 700, 10)]
    assert min(values) > 0.0


@pytest.mark.parametrize(
    ("typed", "near"), [("30", "304"), ("nikel", "nickel"), ("mild_steel", "mild-steel")]
)
def test_an_unknown_name_lists_the_nearest(typed, near):
    with pytest.raises(UnknownNameError, match=near):
        load_material(typed)


def test_an_unknown_temper_lists_the_tempers():
    with pytest.raises(UnknownNameError, match="full-hard"):
        load_material("304/hard")


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("at_1064nm = 0.35", "at_1064nm = 1.35", r"\$\.absorptivity\.at_1064nm"),
        ("at_1064nm = 0.35", "at_1064nm = 0.0", r"\$\.absorptivity\.at_1064nm"),
        ("at_1064nm = 0.35", "at_1064nm = nan", r"\$\.absorptivity\.at_1064nm"),
        ("at_1064nm = 0.35", 'at_1064nm = "high"', r"\$\.absorptivity\.at_1064nm"),
        ("density_kg_m3 = 7900", "density_kg_m3 = -7900", r"\$\.constants\.density_kg_m3"),
        ("density_kg_m3 = 7900", "densty = 7900", r"\$\.constants"),
        ("poisson = 0.29", "poisson = 0.5", r"\$\.constants\.poisson"),
        ("anneal_c = 780", "anneal_c = 1800", r"\$\.constants\.anneal_c"),
        ("[20, 100, 200,", "[20, 200, 100,", r"\$\.table\.temperature_c"),
        ("[198.5, 193,", "[198.5,", r"\$\.table\.young_gpa"),
        ("[265, 218,", "[265, -218,", r"\$\.table\.yield_mpa"),
        ('temper = "annealed"', 'temper = "soft"', r"\$\.material\.temper"),
        ("yield_mpa = 515", "yield_mpa = 0", r"\$\.temper\.half-hard\.yield_mpa"),
        (
            'grade = "B", source = "handbook',
            'grade = "D", source = "handbook',
            r"\$\.grades\[\.\.\.\]\.grade",
        ),
        ("schema = 1", "schema = 2", r"\$\.schema"),
        ("[constants]", "[constants", "not valid TOML"),
        ("[absorptivity]", "[forming]\nscatter_pass = -1.0\n[absorptivity]", r"\$\.forming\.scatter_pass"),
        ("[absorptivity]", "[forming]\ngain = 0\n[absorptivity]", r"\$\.forming\.gain"),
        ("[absorptivity]", "[forming]\nneutral_share = 2\n[absorptivity]", r"\$\.forming\.neutral_share"),
    ],
)
def test_a_mistake_is_named_with_its_place(old, new, place):
    text = text_of("304")
    assert old in text
    with pytest.raises(ProfileError, match=place) as caught:
        parse_material(text.replace(old, new, 1), "mine.toml")
    assert str(caught.value).startswith("mine.toml: ")


def test_a_section_without_grade_is_refused():
    text = "\n".join(line for line in text_of("304").splitlines() if not line.startswith("table = {"))
    with pytest.raises(ProfileError, match=r"\$\.grades\.table"):
        parse_material(text)


def test_the_hash_is_of_values_not_of_words(tmp_path):
    text = text_of("304")
    assert (
        parse_material(text.replace("the reference metal", "a metal")).sha256 == load_material("304").sha256
    )
    assert parse_material(text.replace("0.35", "0.36")).sha256 != load_material("304").sha256
    own = tmp_path / "own.toml"
    own.write_text(text, "utf-8")
    assert load_material(own) == load_material(str(own)) == load_material("304")


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(ProfileError, match=r"none\.toml"):
        load_material(str(tmp_path / "none.toml"))
    (tmp_path / "latin.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ProfileError, match="UTF-8"):
        load_material(tmp_path / "latin.toml")
    with pytest.raises(RigError):
        load_material(tmp_path)


def test_absorptivity_is_known_at_two_lines_only():
    material = load_material("304")
    assert material.absorptivity_at(1070.0) == material.absorptivity.at_1064nm
    assert material.absorptivity_at(10600.0) == material.absorptivity.at_10600nm
    with pytest.raises(ProfileError, match="450 nm"):
        material.absorptivity_at(450.0)


def test_co2_light_follows_hagen_rubens():
    """0.365 sqrt(resistivity / wavelength) for 304 with 72 µΩ cm is 0.095."""
    assert load_material("304").absorptivity.at_10600nm == pytest.approx(
        0.365 * math.sqrt(72e-6 / 10.6e-4), rel=0.1
    )


@pytest.mark.parametrize("name", SHIPPED)
def test_the_files_say_the_source_of_every_section(name):
    data = tomllib.loads(text_of(name))
    assert set(data["grades"]) == {"constants", "absorptivity", "table", "forming"}
