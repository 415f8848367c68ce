"""Files made from a bundle for other tools: FOLD frames, meshes of the reached shape, pictures, films."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from planner.atomic_file import write_atomic
from studio.errors import UsageError
from studio.film import Moment, RenderError, Stage, choose_gl, moments
from studio.png import animated_png, png
from studio.workspace import Workspace

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["KINDS", "export_file"]

KINDS = {
    ".fold": "FOLD 1.2 with a frame for every fold",
    ".stl": "mesh of the shape that the plan reaches",
    ".ply": "the same as PLY",
    ".obj": "the same as OBJ",
    ".png": "a picture",
    ".apng": "an animation that browsers play",
    ".mp4": "a film (needs ffmpeg, or pip install imageio-ffmpeg)",
}
"""Ending of the file → what it is."""

FILM_PER_S, ANIMATION_PER_S = 24, 10


def export_file(
    ws: Workspace, path: Path, *, step: int | None = None, width: int = 960, height: int = 720
) -> str:
    """Write one file, whole or not at all; returns what it holds, in words.

    Args:
        ws: the bundle; it must have a plan.
        path: its ending says what is written, see ``KINDS``.
        step: plan step after which a picture or a mesh is taken; the end when None.
        width: of pictures.
        height: of pictures.

    Raises:
        UsageError: if the ending is unknown or the step is not one of the plan's.
        RenderError: if there is no way to draw or to encode here.
        OSError: if the file cannot be written.
    """
    choose_gl()
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise UsageError(f"{path}: what should that be? Known endings: {', '.join(KINDS)}")
    steps = len(ws.plan.steps)
    if step is not None and not 0 <= step < steps:
        raise UsageError(f"--step {step}: the plan has steps 0 to {steps - 1}")
    if step is not None and kind in (".fold", ".apng", ".mp4"):
        raise UsageError(f"--step is for pictures and meshes; {kind} shows the whole plan")
    if kind == ".fold":
        from planner.fold_frames import write_fold_frames

        write_fold_frames(ws.plan, path)
        return "the flat net and a frame for every fold"
    if kind in (".stl", ".ply", ".obj"):
        return _mesh(ws, path, step)
    if kind == ".png":
        return _still(ws, path, step, width, height)
    return _film(ws, path, width, height)


def _mesh(ws: Workspace, path: Path, step: int | None) -> str:
    import trimesh

    from planner.fold_plan import Fold
    from planner.kinematics import folded_triangles

    angles = np.zeros(len(ws.plan.net.edges))
    for number, one in enumerate(ws.plan.steps):
        if isinstance(one, Fold) and (step is None or number <= step):
            angles[one.crease] = one.to_rad
    corners = folded_triangles(ws.plan.net, angles)
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), process=False)
    if path.suffix.lower() != ".stl":
        mesh.merge_vertices(digits_vertex=6)
    data = mesh.export(file_type=path.suffix.lower()[1:])
    write_atomic(path, data if isinstance(data, bytes) else str(data).encode())
    return f"{len(corners)} triangles in mm, middle surface of the sheet"


def _still(ws: Workspace, path: Path, step: int | None, width: int, height: int) -> str:
    from twin.mjcf_model import compile_model
    from twin.validation import sheet_metal

    compiled = compile_model(ws.plan, sheet_metal(ws.material))
    chosen: Moment | None = None
    for moment in moments(ws.plan, compiled, 0.0):
        if step is not None and moment.step > step:
            break
        chosen = moment
    assert chosen is not None  # noqa: S101  there is always the flat sheet
    with Stage(ws.plan, compiled, width, height) as stage:
        write_atomic(path, png(stage.picture(chosen)))
    return f"{width} x {height} pixels, {'the finished part' if step is None else f'after step {step}'}"


def _film(ws: Workspace, path: Path, width: int, height: int) -> str:
    from twin.mjcf_model import compile_model
    from twin.validation import sheet_metal

    compiled = compile_model(ws.plan, sheet_metal(ws.material))
    rate = FILM_PER_S if path.suffix.lower() == ".mp4" else ANIMATION_PER_S
    shown = list(moments(ws.plan, compiled, rate))

    def each(take: Callable[[NDArray[np.uint8]], None]) -> None:
        with Stage(ws.plan, compiled, width, height) as stage:
            for number, moment in enumerate(shown, 1):
                take(stage.picture(moment))
                ws.progress.update(number / len(shown), f"picture {number} of {len(shown)}")

    if path.suffix.lower() == ".apng":
        pictures: list[NDArray[np.uint8]] = []
        each(pictures.append)
        write_atomic(path, animated_png(pictures, rate))
    else:
        _encode(path, width, height, rate, each)
    return f"{len(shown)} pictures of {width} x {height}, {len(shown) / rate:.0f} s"


def _encode(
    path: Path,
    width: int,
    height: int,
    rate: int,
    each: Callable[[Callable[[NDArray[np.uint8]], None]], None],
) -> None:
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path.parent} is no folder")
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".film-") as folder:
        made = Path(folder) / "film.mp4"
        command = [
            _ffmpeg(), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s",
            f"{width}x{height}", "-r", str(rate), "-i", "-", "-an", "-c:v", "libx264", "-pix_fmt", "yuv420p",
            "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-movflags", "+faststart", str(made),
        ]  # fmt: skip
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE)  # noqa: S603  no shell
        assert process.stdin is not None and process.stderr is not None  # noqa: S101
        pipe = process.stdin
        try:
            each(lambda image: _into(pipe, image))
        except BrokenPipeError:
            pass  # ffmpeg says why
        except BaseException:
            process.kill()
            process.wait()
            raise
        _, words = process.communicate()
        if process.returncode:
            raise RenderError(f"ffmpeg failed: {words.decode('utf-8', 'replace').strip()[:300]}")
        made.replace(path)


def _into(pipe: IO[bytes], image: NDArray[np.uint8]) -> None:
    pipe.write(image.tobytes())


def _ffmpeg() -> str:
    found = shutil.which("ffmpeg")
    if found:
        return found
    try:
        from imageio_ffmpeg import get_ffmpeg_exe
    except ImportError:
        raise RenderError(
            "a film needs ffmpeg: install it, or `pip install imageio-ffmpeg`, or write an "
            "animation that needs "
            "nothing: FILE.apng"
        ) from None
    return str(get_ffmpeg_exe())
