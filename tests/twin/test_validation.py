"""The certificate: its verdict, its figures, its file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.fold_plan import Fold
from planner.kinematics import folded_triangles, rigid_fit
from tests.twin.hand_plans import box, breadth_first_net, icosahedron, outside_in_steps, plan_of, star
from tests.twin.test_dynamics import over_folded, process_of
from twin.errors import ModelError, ValidationFileError
from twin.mjcf_model import compile_model
from twin.shape_error import folded_draws, shape_errors
from twin.validation import validate
from twin.validation_file import (
    read_validation,
    read_validation_hashes,
    validation_bytes,
    write_validation,
)


def test_a_clean_plan_passes_with_its_figures() -> None:
    plan = plan_of(breadth_first_net(star()))
    process = process_of(plan)
    result = validate(plan, process)
    assert result.verdict == "pass"
    assert result.events == result.missed_by_dynamics == ()
    assert (result.energy_j, result.seconds, result.passes) == (
        process.energy_j,
        process.seconds,
        process.passes,
    )
    assert result.process == "uncalibrated"
    assert validate(plan, replace(process, calibration="fitted")).process == "calibrated"
    assert result.heating == "test-model"
    assert {h.crease for h in result.hinges} == {s.crease for s in plan.steps if isinstance(s, Fold)}
    for hinge in result.hinges:
        assert hinge.reached_rad == pytest.approx(hinge.wanted_rad, abs=np.radians(0.05))
    assert result.shape_rms < 0.01
    assert result.shape_rms <= result.max_vertex_error
    assert result.model_sha256 == compile_model(plan).sha256


def test_over_folding_is_contact_and_half_a_plan_is_far_from_the_goal() -> None:
    assert validate(over_folded(box(20, 20, 20), 1.3), draws=5).verdict == "contact"
    net = breadth_first_net(star())
    half = plan_of(
        net, [replace(s, to_rad=s.to_rad / 2) if isinstance(s, Fold) else s for s in outside_in_steps(net)]
    )
    result = validate(half, draws=5)
    assert result.verdict == "pass"  # the plan is carried out; how far it goes is the plan's own matter
    assert result.shape_rms > 1.0


def test_hidden_crease_is_occluded() -> None:
    assert validate(plan_of(breadth_first_net(box())), draws=5).verdict == "occluded"


def test_weak_heating_stalls() -> None:
    plan = plan_of(breadth_first_net(star()))
    result = validate(plan, process_of(plan, 0.5), draws=5)
    assert result.verdict == "stall"
    assert "instead of" in result.events[0].detail


def test_a_model_of_another_plan_is_refused() -> None:
    with pytest.raises(ModelError, match="another net"):
        validate(plan_of(breadth_first_net(star())), model=compile_model(plan_of(breadth_first_net(box()))))


def test_file_holds_the_certificate(tmp_path: Path) -> None:
    plan = over_folded(box(20, 20, 20), 1.3)
    result = validate(plan, draws=5)
    path = tmp_path / "validation.json"
    hashes = {"plan": "p" * 64, "job": "j" * 64}
    write_validation(result, path, hashes)
    data = json.loads(path.read_text())
    assert data["verdict"] == "contact"
    assert data["plan_sha256"] == "p" * 64
    assert data["events"][0]["angle"] == pytest.approx(np.degrees(result.events[0].angle_rad), abs=1e-8)
    for key in (
        "events", "hinges", "shape_rms", "max_vertex_error", "missed_by_dynamics", "energy_j", "seconds",
        "passes", "heating", "scatter", "mujoco", "model_sha256", "state_sha256",
    ):  # fmt: skip
        assert key in data
    again = read_validation(path)
    assert validation_bytes(again, hashes) == path.read_bytes()
    assert again.verdict == result.verdict
    assert [e.pair for e in again.events] == [e.pair for e in result.events]
    assert read_validation_hashes(path).items() >= hashes.items()
    assert validation_bytes(validate(plan, draws=5), hashes) == path.read_bytes()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "not JSON"),
        ("[1]", "not a certificate"),
        ('{"format": "metal-blossom/plan"}', "not a certificate"),
        ('{"format": "metal-blossom/validation", "version": 9}', "version 9"),
        ('{"format": "metal-blossom/validation", "version": 1}', "not a complete certificate"),
        ("[" * 100_000, "not JSON"),
    ],
)
def test_files_that_are_no_certificate_are_refused_in_words(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "validation.json"
    path.write_text(text)
    with pytest.raises(ValidationFileError, match=said):
        read_validation(path)


def test_folding_all_draws_at_once_is_folding_each() -> None:
    net = breadth_first_net(icosahedron(30, 1))
    rng = np.random.default_rng(5)
    angles = net.fold_angle * rng.uniform(-1, 1.5, (6, len(net.edges)))
    corners = folded_draws(net, angles)
    rms, worst = shape_errors(net, corners)
    target = net.goal.vertices[net.goal.faces].reshape(-1, 3)
    for n in range(6):
        alone = folded_triangles(net, angles[n])
        assert corners[n] == pytest.approx(alone, abs=1e-9)
        turn, shift = rigid_fit(alone.reshape(-1, 3), target)
        distance = np.linalg.norm(alone.reshape(-1, 3) @ turn.T + shift - target, axis=1)
        assert rms[n] == pytest.approx(np.sqrt((distance**2).mean()), rel=1e-9)
        assert worst[n] == pytest.approx(distance.max(), rel=1e-9)
