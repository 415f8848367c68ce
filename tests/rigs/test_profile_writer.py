"""Profiles written as TOML read back as they were."""

from __future__ import annotations

import tomllib

import msgspec
import pytest

from rigs.material import load_material, material_names, parse_material
from rigs.profile_writer import profile_toml
from rigs.rig import load_rig, parse_rig, rig_names


@pytest.mark.parametrize("name", material_names())
def test_materials_read_back(name):
    material = load_material(name)
    assert parse_material(profile_toml(material)) == material


@pytest.mark.parametrize("name", rig_names())
def test_rigs_read_back(name):
    rig = load_rig(name)
    assert parse_rig(profile_toml(rig)) == rig


def test_awkward_words_are_quoted():
    material = load_material("304")
    odd = 'say "hi" \\ °\n\ttab'
    named = msgspec.structs.replace(
        material,
        material=msgspec.structs.replace(material.material, notes=odd),
        temper={**material.temper, "half hard.1": material.temper["half-hard"]},
    )
    text = profile_toml(named, "first\nsecond")
    assert text.startswith("# first\n# second\n")
    assert parse_material(text) == named and tomllib.loads(text)["material"]["notes"] == odd
