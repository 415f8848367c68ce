"""The fit of a fold angle to corners of tags: its error, an honest sigma, words where there is none."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

cv2 = pytest.importorskip("cv2")

from planner.kinematics import rotation_about_line  # noqa: E402
from rigs.errors import JobError  # noqa: E402
from rigs.hinge_fit import Hinge, Lens, fit_hinge  # noqa: E402
from rigs.tag_layout import Tag  # noqa: E402

LENS = Lens(
    np.array([(900.0, 0.0, 320.0), (0.0, 905.0, 240.0), (0.0, 0.0, 1.0)]),
    np.array([-0.1, 0.02, 1e-3, -5e-4, 0.0]),
)
FIXED, TURNING = Tag(3, 0, (-4.0, 1.0), 5.0, 10.0), Tag(8, 1, (4.5, -1.0), 6.0, -30.0)
HINGE = Hinge(np.array([0.0, -8.0]), np.array([0.0, 8.0]), {3: FIXED.corners_mm}, {8: TURNING.corners_mm})


def corners(angle_rad, rng, *, px=0.0, mm=0.0, away=70.0, lean=0.5, tags=(FIXED, TURNING)):
    """Corners of the tags in a picture from between the two faces, tags placed wrongly by ``mm``."""
    start, end = np.append(HINGE.start, 0.0), np.append(HINGE.end, 0.0)
    turn = rotation_about_line(start, end, angle_rad)
    view = np.array(rotation_about_line(np.zeros(3), np.array([0.0, 1.0, 0.0]), 0.5 * angle_rad)[:3, :3]).T
    for axis, by in (
        (0, rng.uniform(-lean, lean)),
        (1, rng.uniform(-lean, lean)),
        (2, rng.uniform(-3.0, 3.0)),
    ):
        view = rotation_about_line(np.zeros(3), np.eye(3)[axis], by)[:3, :3] @ view
    flip = np.diag([1.0, -1.0, -1.0])
    out = {}
    for tag, moves in zip(tags, (False, True), strict=True):
        dx, dy, spin = rng.normal(0.0, mm, 3)
        tag = replace(
            tag, centre_mm=(tag.centre_mm[0] + dx, tag.centre_mm[1] + dy),
            turned_deg=tag.turned_deg + math.degrees(spin / tag.size_mm),
        )  # fmt: skip
        places = np.column_stack([tag.corners_mm, np.zeros(4)])
        if moves:
            places = places @ turn[:3, :3].T + turn[:3, 3]
        out[tag.number] = LENS.project(places @ (flip @ view).T + (0.0, 0.0, away)) + rng.normal(
            0.0, px, (4, 2)
        )
    return out


def test_the_lens_is_that_of_opencv():
    rng = np.random.default_rng(1)
    points = rng.uniform((-20.0, -20.0, 60.0), (20.0, 20.0, 90.0), (50, 3))
    theirs, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), LENS.matrix, LENS.distortion)
    assert np.allclose(LENS.project(points), theirs.reshape(-1, 2), atol=1e-9)


def test_clean_corners_give_the_angle():
    rng = np.random.default_rng(2)
    for angle in (-1.9, -1.0, -0.3, 0.0, 0.02, 0.7, 1.5, 2.0):
        fit = fit_hinge(corners(angle, rng), HINGE, LENS, angle + 0.1)
        assert fit.angle_rad == pytest.approx(angle, abs=1e-4) and fit.misfit < 0.05


@pytest.mark.parametrize(("px", "mm"), [(0.05, 0.0), (0.05, 0.05), (0.2, 0.05), (0.2, 0.0)])
def test_the_standard_deviation_is_honest(px, mm):
    """Corners noisier than assumed widen it by themselves; places as wrong as stated are counted in."""
    rng = np.random.default_rng(int(1000 * px + 10 * mm))
    scores = []
    for _ in range(60):
        angle = rng.uniform(-1.6, 1.6)
        seen = corners(angle, rng, px=px, mm=mm)
        fit = fit_hinge(seen, HINGE, LENS, angle + rng.normal(0.0, 0.05), placed_mm=max(mm, 0.01))
        scores.append((fit.angle_rad - angle) / fit.sigma_rad)
    assert (np.abs(scores) < 2.0).mean() >= 0.88
    assert 0.3 < np.sqrt(np.mean(np.square(scores))) < 1.35


def test_a_missing_tag_is_named():
    seen = corners(0.5, np.random.default_rng(3))
    with pytest.raises(JobError, match=r"side that turns \(expected 8; seen: 3\)"):
        fit_hinge({3: seen[3]}, HINGE, LENS, 0.5)
    with pytest.raises(JobError, match=r"side that stays \(expected 3; seen: none\)"):
        fit_hinge({}, HINGE, LENS, 0.5)


def test_tags_that_are_somewhere_else_are_refused():
    rng = np.random.default_rng(4)
    seen = corners(0.6, rng)
    with pytest.raises(JobError, match="not where they should be"):
        fit_hinge({3: seen[8], 8: seen[3]}, HINGE, LENS, 0.6)  # exchanged
    elsewhere = corners(0.6, rng, tags=(FIXED, replace(TURNING, centre_mm=(8.0, 3.0))))
    with pytest.raises(JobError, match="not where they should be"):
        fit_hinge(elsewhere, HINGE, LENS, 0.6)
    turned = corners(0.6, rng, tags=(FIXED, replace(TURNING, turned_deg=60.0)))
    with pytest.raises(JobError, match="not where they should be"):
        fit_hinge(turned, HINGE, LENS, 0.6)


def test_a_far_camera_knows_that_it_knows_little():
    rng = np.random.default_rng(5)
    near, far = (
        fit_hinge(corners(0.4, rng, px=0.05, away=away, lean=0.3), HINGE, LENS, 0.4) for away in (60.0, 300.0)
    )
    assert far.sigma_rad > 3.0 * near.sigma_rad
