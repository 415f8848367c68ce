"""A camera on rendered pictures of the part: errors over poses, and words for pictures that tell nothing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

cv2 = pytest.importorskip("cv2")

from planner.kinematics import face_transforms  # noqa: E402
from rigs.camera import CameraGauge, open_pictures  # noqa: E402
from rigs.camera_file import camera_text, read_camera  # noqa: E402
from rigs.errors import JobError, MachineError, ProfileError  # noqa: E402
from rigs.hinge_fit import Lens  # noqa: E402
from rigs.tag_layout import hinge_of, tags_for  # noqa: E402
from rigs.tag_pictures import find_tags  # noqa: E402
from tests.rigs.made_jobs import made_plan  # noqa: E402
from twin.part_pictures import Scene, part_picture, view_of_crease  # noqa: E402

LENS = Lens(
    np.array([(900.0, 0.0, 320.0), (0.0, 900.0, 240.0), (0.0, 0.0, 1.0)]),
    np.array([-0.1, 0.02, 1e-3, -5e-4, 0.0]),
)
SIZE = (640, 480)
SCENE = Scene(rays=2)
LEAN = {"lean": (0.3, 0.2), "roll_rad": 0.4}


@pytest.fixture(scope="module")
def net():
    return made_plan("box").net


@pytest.fixture(scope="module")
def tags(net):
    return tags_for(net)


@pytest.fixture
def file(net, tags, tmp_path):
    (tmp_path / "camera.toml").write_text(
        camera_text(tags, family="36h11", source="0", size_px=SIZE, lens=LENS)
    )
    return read_camera(tmp_path / "camera.toml", len(net.faces))


def shot(net, tags, crease, angle_deg, scene=SCENE, **view):
    angles = np.zeros(len(net.edges))
    angles[crease] = math.radians(angle_deg)
    where = {"away_mm": 80.0} | view
    camera = view_of_crease(net, angles, crease, LENS, SIZE, **where)
    child = net.child_of[crease]
    near = {child, int(net.parent[child])}
    faces = [f for f in range(len(net.faces)) if f in near or net.assignment[net.crease_of[f]] == "F"]
    faces += [int(net.parent[f]) for f in faces]
    return part_picture(net, angles, tags, camera, scene, faces=sorted({f for f in faces if f >= 0}))


def test_tags_lie_on_their_faces_and_on_both_sides_of_creases(net, tags):
    for tag in tags:
        a, b, c = net.vertices[net.faces[tag.face]]
        for p in tag.corners_mm:
            inside = [
                (q[0] - o[0]) * (p[1] - o[1]) - (q[1] - o[1]) * (p[0] - o[0])
                for o, q in ((a, b), (b, c), (c, a))
            ]
            assert min(inside) > 0.0
    for crease in net.child_of:
        if net.assignment[crease] in ("V", "M"):
            hinge = hinge_of(net, crease, tags)
            assert hinge.fixed and hinge.turning
    with pytest.raises(JobError, match="no crease"):
        hinge_of(net, int(np.flatnonzero(net.assignment == "B")[0]), tags)


@pytest.mark.parametrize("side", ["top", "bottom"])
def test_corners_are_found_to_a_tenth_of_a_pixel(net, side):
    tags = tags_for(net, side=side)
    angles = np.zeros(len(net.edges))
    angles[4] = 0.8
    view = view_of_crease(
        net,
        angles,
        4,
        LENS,
        SIZE,
        away_mm=80.0,
        lean=(0.3, 0.2),
        roll_rad=0.5,
        side=1.0 if side == "top" else -1.0,
    )
    seen = find_tags(part_picture(net, angles, tags, view, SCENE))
    transforms = face_transforms(net, angles)
    assert len(seen) >= 3
    for tag in tags:
        if tag.number in seen:
            places = np.column_stack([tag.corners_mm, np.zeros(4)]) @ transforms[tag.face, :3, :3].T
            places = places + transforms[tag.face, :3, 3]
            true = LENS.project(places @ view.turn.T + view.move)
            assert np.abs(seen[tag.number] - true).max() < 0.15


def test_angles_over_poses(net, tags, file):
    """Errors well below a pass, and a standard deviation that covers them."""
    rng = np.random.default_rng(7)
    scores = []
    for k, angle in enumerate((-75.0, -40.0, -12.0, 3.0, 25.0, 50.0, 80.0)):
        crease = (6, 4, 16)[k % 3]
        scene = replace(SCENE, noise=rng.uniform(1.0, 4.0), blur_px=rng.uniform(0.4, 1.1), seed=k)
        picture = shot(
            net, tags, crease, angle, scene, lean=(rng.uniform(-0.4, 0.4), rng.uniform(-0.3, 0.3)),
            roll_rad=rng.uniform(-3.0, 3.0),
        )  # fmt: skip
        gauge = CameraGauge(net, file, lambda picture=picture: picture)
        measured, sigma = gauge(crease, angle + rng.normal(0.0, 5.0))
        assert abs(measured - angle) < 1.0 and sigma < 2.0
        scores.append((measured - angle) / sigma)
    assert np.abs(scores).max() < 2.5


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (replace(SCENE, brightness=0.04), "dark"),
        (replace(SCENE, brightness=30.0), "over-exposed"),
        (replace(SCENE, blur_px=9.0), "blurred"),
    ],
)
def test_bad_pictures_are_told_in_words(net, tags, file, scene, words):
    picture = shot(net, tags, 6, 40.0, scene)
    with pytest.raises(JobError, match=f"crease 6: the picture is {words}"):
        CameraGauge(net, file, lambda: picture)(6, 40.0)


def test_missing_and_wrong_tags(net, tags, file):
    side = hinge_of(net, 6, tags)
    turning = [t for t in tags if t.number in side.turning]
    gauge = CameraGauge(net, file, lambda: shot(net, [t for t in tags if t not in turning], 6, 40.0))
    with pytest.raises(JobError, match=f"no tag on the side that turns .expected {turning[0].number}"):
        gauge(6, 40.0)
    wrong = [replace(t, turned_deg=30.0) if t in turning else t for t in tags]
    gauge = CameraGauge(net, file, lambda: shot(net, wrong, 6, 40.0))
    with pytest.raises(JobError, match="not where they should be"):
        gauge(6, 40.0)
    other = next(t for t in tags if t.number in side.fixed)
    doubled = [replace(t, number=turning[0].number) if t == other else t for t in tags]
    with pytest.raises(JobError, match="no tag on the side"):
        CameraGauge(net, file, lambda: shot(net, doubled, 6, 40.0))(6, 40.0)


def test_a_part_that_moves_and_a_picture_of_another_size(net, tags, file):
    pictures = iter([shot(net, tags, 6, angle) for angle in (30.0, 30.0, 42.0)])
    with pytest.raises(JobError, match="wait until the part rests"):
        CameraGauge(net, file, lambda: next(pictures))(6, 35.0)
    with pytest.raises(JobError, match="calibration is for 640 x 480"):
        CameraGauge(net, file, lambda: np.zeros((100, 100), np.uint8))(6, 35.0)


def test_pictures_from_files(net, tags, file, tmp_path):
    cv2.imwrite(str(tmp_path / "one.png"), shot(net, tags, 6, 30.0, **LEAN))
    cv2.imwrite(str(tmp_path / "two.png"), cv2.cvtColor(shot(net, tags, 6, 60.0, **LEAN), cv2.COLOR_GRAY2BGR))
    assert CameraGauge(net, file, open_pictures(str(tmp_path / "one.png")))(6, 30.0)[0] == pytest.approx(
        30.0, abs=1
    )
    assert CameraGauge(net, file, open_pictures(str(tmp_path)))(6, 60.0)[0] == pytest.approx(60.0, abs=1)
    (tmp_path / "broken.png").write_bytes(b"no picture")
    for source, words in (("broken.png", "not a picture"), ("none.png", "no camera, picture or folder")):
        with pytest.raises(MachineError, match=words):
            open_pictures(str(tmp_path / source))()
    (tmp_path / "empty").mkdir()
    with pytest.raises(MachineError, match="no picture in it"):
        open_pictures(str(tmp_path / "empty"))()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("schema = 1", "schema = 2", r"\$.schema"),
        ("[900, 0, 320]", "[-900, 0, 320]", r"\$.camera.matrix"),
        ('family = "36h11"', 'family = "49h12"', r"\$.tags.family"),
        ("number = 2\n", "number = 1\n", "listed twice"),
        ("face = 2\n", "face = 99\n", r"\$.tag\[1\].face"),
        ("placed_mm = 0.05", "placed_mm = nan", "finite"),
        ("[tags]", "[tagz]", "tagz"),
    ],
)
def test_mistakes_of_a_camera_file_are_named(net, tags, tmp_path, old, new, words):
    text = camera_text(tags, family="36h11", source="0", size_px=SIZE, lens=LENS)
    assert old in text
    path = tmp_path / "camera.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ProfileError, match=words):
        read_camera(path, len(net.faces))
    with pytest.raises(ProfileError, match="cannot read"):
        read_camera(tmp_path / "none.toml", 4)
