"""``blossom export``: every file is read back by something that did not write it."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest
import trimesh

from studio.cli import main
from studio.export_files import _ffmpeg
from studio.film import RenderError
from studio.png import animated_png, png
from tests.planner.test_fold_frames import fold_rules
from tests.studio.test_explain import OBJ

os.environ.setdefault("MUJOCO_GL", "egl")


def chunks(data: bytes) -> list[tuple[bytes, bytes]]:
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    out, at = [], 8
    while at < len(data):
        (size,) = struct.unpack(">I", data[at : at + 4])
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + size]
        assert struct.unpack(">I", data[at + 8 + size : at + 12 + size])[0] == zlib.crc32(kind + body)
        out.append((kind, body))
        at += 12 + size
    assert out[-1] == (b"IEND", b"")
    return out


def unpacked(body: bytes, width: int, height: int) -> np.ndarray:
    rows = np.frombuffer(zlib.decompress(body), np.uint8).reshape(height, 1 + 3 * width)
    assert (rows[:, 0] == 2).all()
    return np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8).reshape(height, width, 3)


def test_png_files_decode_to_the_picture():
    picture = np.random.default_rng(0).integers(0, 256, (17, 23, 3), dtype=np.uint8)
    found = dict(chunks(png(picture)))
    assert struct.unpack(">IIBBBBB", found[b"IHDR"]) == (23, 17, 8, 2, 0, 0, 0)
    assert np.array_equal(unpacked(found[b"IDAT"], 23, 17), picture)


def test_animations_hold_every_picture():
    pictures = [np.full((4, 6, 3), k, dtype=np.uint8) for k in (10, 20, 30)]
    found = chunks(animated_png(pictures, 10))
    assert struct.unpack(">II", dict(found)[b"acTL"]) == (3, 1)
    bodies = [body if kind == b"IDAT" else body[4:] for kind, body in found if kind in (b"IDAT", b"fdAT")]
    for body, picture in zip(bodies, pictures, strict=True):
        assert np.array_equal(unpacked(body, 6, 4), picture)
    order = [struct.unpack(">I", body[:4])[0] for kind, body in found if kind in (b"fcTL", b"fdAT")]
    assert order == list(range(len(order)))
    with pytest.raises(ValueError, match="at least one"):
        animated_png([], 10)


@pytest.fixture(scope="module")
def bundle(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    (folder / "sheet.obj").write_text(OBJ.format(z=15.0))
    assert main(["net", str(folder / "sheet.obj"), "-o", str(folder / "out"), "-q"]) == 0
    assert main(["plan", str(folder / "out"), "--no-diagnosis", "-q"]) == 0
    return folder / "out"


def test_meshes_and_frames(bundle, tmp_path, capsys):
    names = ["folding.fold", "reached.stl", "reached.ply", "reached.obj"]
    assert main(["export", str(bundle), *(str(tmp_path / n) for n in names), "-q"]) == 0
    assert "a frame for every fold" in capsys.readouterr().out
    fold_rules(json.loads((tmp_path / "folding.fold").read_text()))
    goal = trimesh.load(bundle / "goal.ply")
    for name in names[1:]:
        mesh = trimesh.load(tmp_path / name)
        assert len(mesh.faces) == len(goal.faces)
        assert mesh.area == pytest.approx(goal.area, rel=1e-5)
        assert np.sort(mesh.edges_unique_length) == pytest.approx(np.sort(goal.edges_unique_length), rel=1e-4)
    assert main(["export", str(bundle), str(tmp_path / "flat.stl"), "--step", "0", "-q"]) == 0
    flat = trimesh.load(tmp_path / "flat.stl")
    assert np.ptp(flat.vertices[:, 2]) < 1e-6 < np.ptp(trimesh.load(tmp_path / "reached.stl").vertices[:, 2])


def test_pictures(bundle, tmp_path):
    size = ["--width", "160", "--height", "120", "-q"]
    for name, step in (("start.png", ["--step", "0"]), ("end.png", []), ("again.png", [])):
        assert main(["export", str(bundle), str(tmp_path / name), *step, *size]) == 0
    start, end = (
        unpacked(dict(chunks((tmp_path / n).read_bytes()))[b"IDAT"], 160, 120)
        for n in ("start.png", "end.png")
    )
    assert start.std() > 10 and end.std() > 5 and np.abs(start.astype(int) - end.astype(int)).mean() > 3
    assert (tmp_path / "again.png").read_bytes() == (tmp_path / "end.png").read_bytes()


def test_films(bundle, tmp_path):
    size = ["--width", "161", "--height", "120", "-q"]
    assert main(["export", str(bundle), str(tmp_path / "film.apng"), *size]) == 0
    kinds = [kind for kind, _ in chunks((tmp_path / "film.apng").read_bytes())]
    assert kinds.count(b"fcTL") > 10
    try:
        ffmpeg = _ffmpeg()
    except RenderError:
        assert main(["export", str(bundle), str(tmp_path / "film.mp4"), *size]) == 2
        return
    assert main(["export", str(bundle), str(tmp_path / "film.mp4"), *size]) == 0
    told = subprocess.run([ffmpeg, "-i", str(tmp_path / "film.mp4")], capture_output=True, text=True)
    assert "h264" in told.stderr and "162x120" in told.stderr
    assert not list(tmp_path.glob(".film-*"))


@pytest.mark.parametrize(
    "words",
    [["x.docx"], ["x.png", "--step", "9999"], ["x.fold", "--step", "1"], ["x.png", "--width", "100000"], []],
)
def test_what_makes_no_sense(bundle, tmp_path, words, capsys):
    named = [str(tmp_path / w) if "." in w else w for w in words]
    assert main(["export", str(bundle), *named, "-q"]) == 2
    assert capsys.readouterr().err.startswith("error: ")
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there(bundle, tmp_path, capsys):
    assert main(["export", str(bundle), str(tmp_path / "no" / "x.stl"), "-q"]) == 2
    assert "no" in capsys.readouterr().err
