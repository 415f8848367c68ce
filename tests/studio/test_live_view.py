"""The live view: on the loopback address only, with the poses of the plan and of the machine."""

from __future__ import annotations

import contextlib
import io
import math
import os
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from planner.kinematics import folded_triangles
from studio.bundle_check import open_manifest
from studio.live_plan import PlanView
from studio.live_replay import BANNERS, ReplayView
from studio.live_server import HOST, ViewError, live_server, url_of
from studio.live_stage import replay_view
from studio.plan_moment import moment_at
from studio.progress import Progress
from studio.workspace import Workspace
from tests.studio.small_plan import small_plan

pytest.importorskip("viser")
BLOSSOM = str(Path(sys.executable).parent / "blossom")


@pytest.fixture(scope="module")
def server():
    with live_server("test", 8420) as server:
        yield server


@pytest.fixture(scope="module")
def ws(tmp_path_factory):
    from models.goals import goal_path
    from studio.cli import main

    folder = tmp_path_factory.mktemp("live") / "flower"
    assert main(["net", str(goal_path("flower")), "-o", str(folder), "--method", "steepest", "-q"]) == 0
    assert main(["plan", str(folder), "-q"]) == 0
    assert main(["job", str(folder), "-q"]) == 0
    return Workspace(folder, open_manifest(folder), Progress(stream=io.StringIO()))


def listeners(port):
    """Addresses at which this computer listens on a TCP port, from the kernel's tables."""
    found = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        with contextlib.suppress(OSError):
            for line in Path(table).read_text().splitlines()[1:]:
                local, state = line.split()[1], line.split()[3]
                if state == "0A" and int(local.split(":")[1], 16) == port:
                    found.add(local.split(":")[0])
    return found


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="no table of listeners on this system")
def test_it_listens_on_the_loopback_address_and_nowhere_else(server):
    assert url_of(server).startswith(f"http://{HOST}:")
    assert listeners(server.get_port()) == {"0100007F"}
    with urllib.request.urlopen(url_of(server), timeout=30) as answer:  # noqa: S310
        assert answer.status == 200


def test_a_taken_port_is_passed_over(server):
    with live_server("second", server.get_port()) as other:
        assert other.get_port() != server.get_port()


def corners_of(stand):
    """(F, 3, 3) corners of the faces that can move, as the scene has them."""
    return np.reshape(stand.part.vertices, (-1, 3, 3))


@pytest.mark.parametrize("time", [0.0, 3.5, 5.25, 8.75, 11.0])
def test_the_slider_sets_the_pose_of_the_plan(server, time):
    plan = small_plan()
    view = PlanView(server, plan)
    view.slider.value = time
    moment = moment_at(plan, time)
    moves = ~np.isin(np.arange(6), plan.net.base_panel)
    np.testing.assert_allclose(
        corners_of(view.stand), folded_triangles(plan.net, moment.angles_rad)[moves], atol=1e-4
    )
    half = moment.rotary_rad / 2.0
    np.testing.assert_allclose(view.stand.turned.wxyz, [math.cos(half), math.sin(half), 0.0, 0.0], atol=1e-12)
    assert view.stand.sheet.visible == (time < 11)
    assert len(view.stand.sheet.faces) == (9 if time < 2 else 8)
    assert view.stand.beam.visible == (time in (3.5, 5.25, 8.75))
    assert moment.text in view.text.content


def test_moments_of_a_plan():
    plan = small_plan()
    full = float(plan.net.fold_angle[0])
    half = moment_at(plan, 3.5)
    assert (half.crease, half.rotary_rad, half.gone) == (0, pytest.approx(math.pi), frozenset({8}))
    assert half.angles_rad[0] == pytest.approx(0.5 * full)
    assert half.text.startswith("fold crease 0 (mountain) from 0°")
    assert moment_at(plan, -1.0).text == "flat sheet"
    assert moment_at(plan, 99.0).released
    np.testing.assert_allclose(moment_at(plan, 99.0).angles_rad, plan.final_angles)


def test_steps_and_play(server):
    view = PlanView(server, small_plan())
    view.slider.value = 2.5
    view._step(1)
    assert view.slider.value == 3.0
    view._step(1)
    assert view.slider.value == 4.0
    view._step(-1)
    assert view.slider.value == 3.0
    view.playing.value, view.speed.value = True, 30.0
    rounds = iter([True] * 40 + [False])
    view.run(lambda: next(rounds))
    assert view.slider.value == 11.0
    assert not view.playing.value


def replayed(view, job, count, s=0.0):
    turn = view.rig.rotary
    for index, block in enumerate(job.blocks[:count]):
        place = dict(zip("XYZ", block.end, strict=True))
        place[turn.word] = math.degrees(block.rotary_rad) * turn.units_per_deg * turn.sign
        sent = SimpleNamespace(index=index, step=block.step)
        view.begins(sent, block.seconds, 0.0)
        view.reports(SimpleNamespace(state="Run", s=s), place, 0.0)
        view.confirmed(sent, place, 0.0)


def test_machine_and_twin_fold_side_by_side(server, ws):
    from studio.gauges import workpiece_of

    told = []
    view = ReplayView(server, ws, ws.job, workpiece_of(ws), lit=True, mode="arm", tell=told.append)
    assert BANNERS[None][1] in view.banner.content
    view.progress(SimpleNamespace(block=1, blocks=9, step=0, kind="cut", emulated=True))
    assert "EMULATED" in view.banner.content
    replayed(view, ws.job, len(ws.job.blocks))
    view.finish()
    assert (view.broken, told) == ("", [])
    # the passes of the whole job fold the part as the process predicts; the twin is at the end of the plan
    moves = ~np.isin(np.arange(len(ws.plan.net.faces)), ws.plan.net.base_panel)
    wanted = folded_triangles(ws.plan.net, ws.plan.final_angles)[moves]
    np.testing.assert_allclose(corners_of(view.twin), wanted, atol=1e-3)
    assert np.abs(corners_of(view.machine) - wanted).max() < 1.0
    assert np.abs(corners_of(view.machine)[:, :, 2]).max() > 1.0
    half = ws.job.blocks[-1].rotary_rad / 2.0  # where the last report had the rotary
    np.testing.assert_allclose(
        np.abs(view.machine.turned.wxyz[:2]), np.abs([math.cos(half), math.sin(half)]), atol=1e-6
    )
    view.progress(SimpleNamespace(block=9, blocks=9, step=0, kind="cut", emulated=False))
    assert "REAL machine" in view.banner.content
    assert "EMULATED" not in view.banner.content


def test_without_light_the_part_in_the_machine_stays_flat(server, ws):
    from studio.gauges import workpiece_of

    view = ReplayView(server, ws, ws.job, workpiece_of(ws), lit=False, mode="dry-run", tell=pytest.fail)
    replayed(view, ws.job, len(ws.job.blocks), s=500.0)
    view.finish()
    assert np.abs(corners_of(view.machine)[:, :, 2]).max() == 0.0
    assert np.abs(corners_of(view.twin)[:, :, 2]).max() > 1.0
    assert not view.machine.beam.visible


def test_a_view_that_breaks_leaves_the_machine_alone(server, ws):
    from studio.gauges import workpiece_of

    told = []
    view = ReplayView(server, ws, ws.job, workpiece_of(ws), lit=True, mode="arm", tell=told.append)

    def fail(_angles):
        raise ValueError("no scene any more")

    view.machine.fold = fail
    replayed(view, ws.job, 20)
    view.finish()
    assert told == ["the live view ended (no scene any more); the machine goes on"]


def test_a_replay_on_the_emulator_is_shown(ws, monkeypatch):
    from studio import live_stage
    from studio.replay_stage import replay_stage

    seen = []

    @contextlib.contextmanager
    def kept(*arguments):
        with replay_view(*arguments) as view:
            seen.append(view)
            yield view

    monkeypatch.setattr("studio.replay_stage.replay_view", kept)
    monkeypatch.setattr(live_stage.sys, "stdin", io.StringIO())
    words = replay_stage(ws, "emulator", "frame", view_port=8440)
    assert words.startswith("frame on EMULATED: complete")
    (view,) = seen
    assert view.broken == ""
    assert "EMULATED" in view.banner.content
    assert f"live view: http://{HOST}:" in ws.progress.stream.getvalue()


def test_view_serves_until_ctrl_c(ws):
    done = subprocess.Popen(
        [BLOSSOM, "view", str(ws.folder), "--view-port", "8460"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    line = done.stdout.readline()
    assert line.startswith(f"live view: http://{HOST}:")
    with urllib.request.urlopen(line.split()[2], timeout=60) as answer:  # noqa: S310
        assert b"<html" in answer.read(4000)
    done.send_signal(signal.SIGINT)
    out, err = done.communicate(timeout=60)
    assert (done.returncode, out, err) == (0, "closed\n", "")


def test_without_viser_words_say_what_to_install(ws, monkeypatch, capsys):
    from studio.cli import main

    monkeypatch.setitem(sys.modules, "viser", None)
    before = sorted(path.name for path in ws.folder.iterdir())
    for command in (
        ["view", str(ws.folder)],
        ["replay", str(ws.folder), "--port", "emulator", "--view", "-q"],
    ):
        assert main(command) == 2
        said = capsys.readouterr()
        assert "pip install 'metal-blossom[view]'" in said.err
        assert "Traceback" not in said.err
    assert sorted(path.name for path in ws.folder.iterdir()) == before


@pytest.mark.parametrize("port", ["80", "70000", "x"])
def test_a_port_that_is_none_is_refused(port, capsys):
    from studio.cli import main

    assert main(["view", "nowhere", "--view-port", port]) == 2
    assert "port" in capsys.readouterr().err


def test_no_free_port_ends_in_words(monkeypatch):
    import viser

    def refuse(**_named):
        raise OSError("address in use")

    monkeypatch.setattr(viser, "ViserServer", refuse)
    with pytest.raises(ViewError, match="choose another --view-port"), live_server("x", 8499):
        pytest.fail("must not come here")
