"""The black box: a run that diverges leaves one, it opens, and damage to it is told in words."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from planner.fold_plan import Fold
from tests.twin.hand_plans import breadth_first_net, plan_of, star
from tests.twin.test_dynamics import BLIND, run
from twin.black_box import BlackBox, read_black_box, write_black_box
from twin.errors import RecordFileError
from twin.heating_interface import EqualPasses
from twin.record_file import record_bytes
from twin.retrace import retrace


class NoFigure(EqualPasses):
    """A heating model that gives no number for the third fold."""

    def plastic_increments(self, turn):
        good = super().plastic_increments(turn)
        return good if turn.step < 4 else (float("nan"),) * len(good)


@pytest.fixture(scope="module")
def failed():
    return run(plan_of(breadth_first_net(star())), BLIND, NoFigure())


def test_a_diverged_run_is_a_failed_run_with_a_black_box(failed) -> None:
    assert not failed.finished
    (event,) = [e for e in failed.events if e.kind == "numerical"]
    assert "MuJoCo warned" in event.detail
    assert event.step >= 4 and event.crease >= 0 and len(event.faces) == 2
    box = failed.black_box
    assert box is not None
    assert 1 <= len(box.states) <= BLIND.black_box_states
    assert box.mujoco == mujoco.__version__
    assert box.model_sha256


def test_the_last_step_fails_again_and_all_before_it_give_the_same_bits(failed) -> None:
    traced = retrace(failed.black_box)
    assert traced.same_bits is True
    assert any("Nan" in text or "NaN" in text or "QACC" in text for text in traced.warnings)
    assert np.all(np.diff(traced.time_s) > 0.0)
    assert np.isfinite(traced.angle_rad).all()
    assert not np.isfinite(traced.rest_rad[-1]).all()  # the figure that was none


def test_another_bit_in_a_state_shows(failed) -> None:
    states = np.array(failed.black_box.states)
    states[5, 3] = np.nextafter(states[5, 3], 1.0)
    assert retrace(replace(failed.black_box, states=states)).same_bits is False


def test_another_version_is_not_blamed(failed) -> None:
    assert retrace(replace(failed.black_box, mujoco="3.0.0")).same_bits is None


def test_a_run_that_breaks_its_bounds_leaves_one_too() -> None:
    plan = plan_of(breadth_first_net(star()))
    result = run(plan, replace(BLIND, largest_rate_rad_s=1e-3, black_box_states=7))
    assert result.black_box is not None
    assert len(result.black_box.states) <= 7
    traced = retrace(result.black_box)
    assert traced.same_bits is True
    joint, rate = traced.fastest()
    assert joint in traced.joints and abs(rate) > 0.0


def test_a_run_that_ends_well_leaves_none() -> None:
    assert run(plan_of(breadth_first_net(star())), BLIND).black_box is None


def test_file_holds_the_box(failed, tmp_path: Path) -> None:
    path, other = tmp_path / "a.npz", tmp_path / "b.npz"
    write_black_box(failed.black_box, path, {"plan": "p" * 64})
    box = read_black_box(path)
    assert np.array_equal(box.states, failed.black_box.states, equal_nan=True)
    assert box.event.detail == failed.black_box.event.detail
    assert box.hashes["plan"] == "p" * 64
    write_black_box(box, other)
    assert path.read_bytes() == other.read_bytes()
    assert retrace(box).same_bits is True


def damaged(good: bytes) -> dict[str, bytes]:
    """Name → bytes that are no black box."""
    out = {"empty": b"", "text": b"hello", "half": good[: len(good) // 2]}
    flipped = bytearray(good)
    flipped[len(good) // 3] ^= 0xFF
    out["flipped"] = bytes(flipped)
    with zipfile.ZipFile(io.BytesIO(good)) as archive:
        head = json.loads(archive.read("head.json"))
        arrays = {
            n[:-4]: np.load(io.BytesIO(archive.read(n))) for n in archive.namelist() if n != "head.json"
        }
    out["another format"] = record_bytes(head | {"format": "x"}, arrays)
    out["another version"] = record_bytes(head | {"version": 9}, arrays)
    out["no event"] = record_bytes({k: v for k, v in head.items() if k != "event"}, arrays)
    out["unknown drive"] = record_bytes(head | {"drive": "steam"}, arrays)
    out["an array short"] = record_bytes(head, {k: v for k, v in arrays.items() if k != "after"})
    out["wrong shape"] = record_bytes(head, arrays | {"after": arrays["after"][:-1]})
    out["whole numbers"] = record_bytes(head, arrays | {"states": np.zeros((2, 3), np.int32)})
    with zipfile.ZipFile(buffer := io.BytesIO(), "w") as archive:
        archive.writestr("head.json", "[" * 100_000)
    out["deep"] = buffer.getvalue()
    with zipfile.ZipFile(buffer := io.BytesIO(), "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("head.json", json.dumps(head))
        shape = b"{'descr': '<f8', 'fortran_order': False, 'shape': (999999999999, 9999), }".ljust(117)
        archive.writestr("states.npy", b"\x93NUMPY\x01\x00v\x00" + shape + b"\n")
    out["a huge shape"] = buffer.getvalue()
    return out


def test_damaged_files_are_refused_in_words(failed, tmp_path: Path) -> None:
    path = tmp_path / "box.npz"
    write_black_box(failed.black_box, path)
    for name, data in damaged(path.read_bytes()).items():
        path.write_bytes(data)
        with pytest.raises(RecordFileError, match="validate again"):
            read_black_box(path)
            pytest.fail(name)


def test_a_box_whose_model_does_not_fit_is_refused_in_words(failed) -> None:
    box: BlackBox = failed.black_box
    with pytest.raises(RecordFileError, match="refuses"):
        retrace(replace(box, xml="<mujoco><nonsense/></mujoco>"))
    other = plan_of(breadth_first_net(star(6)), [Fold(int(breadth_first_net(star(6)).crease_of[6]), 0.1)])
    from twin.mjcf_model import compile_model

    with pytest.raises(RecordFileError, match="its states have"):
        retrace(replace(box, xml=compile_model(other).xml))
