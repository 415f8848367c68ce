"""``blossom resume`` on a bundle: what it says and asks, and that it ends where the replay would have."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from rigs.emulator import start_emulator
from rigs.errors import MachineError
from rigs.job_file import read_job
from rigs.journal import read_journal
from rigs.one_process import one_at_a_time
from studio.cli import main
from tests.studio.test_explain import OBJ


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made")
    (folder / "sheet.obj").write_text(OBJ.format(z=15.0))
    assert main(["make", str(folder / "sheet.obj"), "-o", str(folder / "out"), "-q"]) == 0
    for journal in (folder / "out").glob("journal-*"):
        journal.unlink()
    return folder / "out"


@pytest.fixture
def bundle(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "out"))


def job_of(bundle: Path):
    return read_job(bundle / "job.json", bundle / "job.gcode")


def stopped(bundle: Path, kind: str, *, lit: bool = True) -> int:
    """A replay that fails in the middle of a block of a kind; its index."""
    lines = (bundle / "job.gcode").read_text().splitlines()
    sent = [line for line in lines if not line.startswith("(")]
    job = job_of(bundle)
    number = [k for k, b in enumerate(job.blocks) if b.kind == kind][3]
    from rigs.gcode import gcode_program

    before = sum(len(b.lines) for b in gcode_program(job).blocks[: number + 1])
    assert len(sent) > before
    with start_emulator(bundle / "rig.toml", faults=[f"no-ok@{before + 8 + (4 if lit else 1)}"]) as machine:
        assert main(["replay", str(bundle), "--port", machine.url, "--arm", "-q"]) == 3
    return number


def resume(bundle: Path, *words: str) -> int:
    with start_emulator(bundle / "rig.toml") as machine:
        return main(["resume", str(bundle), "--port", machine.url, "-q", *words])


@pytest.mark.parametrize("decision", ["done", "abandon"])
def test_a_pass_in_doubt_needs_a_decision(bundle, capsys, decision):
    stopped(bundle, "pass")
    journal = read_journal(bundle / "journal-001.jsonl")
    assert journal.in_doubt is not None
    capsys.readouterr()
    assert resume(bundle) == 2
    err = capsys.readouterr().err
    assert "Say what becomes of it" in err and "--doubt abandon" in err and "redo" not in err
    assert resume(bundle, "--look") == 0
    assert "blocks are done" in capsys.readouterr().out
    assert resume(bundle, "--doubt", "redo") == 1
    assert "never burnt again" in capsys.readouterr().err
    assert resume(bundle, "--doubt", decision) == 0
    again = read_journal(bundle / "journal-002.jsonl")
    assert again.outcome == "complete" and not set(again.done) & set(journal.done)
    job = job_of(bundle)
    crease = job.blocks[journal.in_doubt].crease
    assert (decision == "abandon") != any(job.blocks[k].crease == crease for k in again.done)
    capsys.readouterr()
    assert resume(bundle, "--doubt", "done") == 2
    assert "ended complete" in capsys.readouterr().err


def test_a_measured_angle_sets_the_passes_that_are_left(bundle, capsys):
    stopped(bundle, "pass")
    journal = read_journal(bundle / "journal-001.jsonl")
    job = job_of(bundle)
    step = job.blocks[journal.in_doubt].step
    same = [k for k, b in enumerate(job.blocks) if b.step == step and b.kind == "pass"]
    left = [k for k in same if k > journal.in_doubt]
    assert resume(bundle, "--angle", "0") == 0  # nothing was gained yet: all that are left are made
    made = [k for k in read_journal(bundle / "journal-002.jsonl").done if k in same]
    assert made == left


def test_an_angle_that_is_there_already_drops_the_rest(bundle):
    stopped(bundle, "pass")
    job = job_of(bundle)
    step = job.blocks[read_journal(bundle / "journal-001.jsonl").in_doubt].step
    from studio.bundle_check import open_manifest
    from studio.progress import Progress
    from studio.workspace import Workspace

    ws = Workspace(bundle, open_manifest(bundle), Progress(quiet=True))
    target = ws.process.fold_at[step].to_rad * 57.29577951308232
    assert resume(bundle, "--angle", f"{target:.3f}") == 0
    assert not [k for k in read_journal(bundle / "journal-002.jsonl").done if job.blocks[k].step == step]


def test_nothing_to_go_on_with(bundle, capsys):
    assert resume(bundle) == 2
    assert "no armed replay of this job has a journal here" in capsys.readouterr().err


def test_another_process_at_the_same_time_is_refused(bundle, capsys):
    stopped(bundle, "cut")
    capsys.readouterr()
    with one_at_a_time(bundle / "manifest.json"):
        assert resume(bundle, "--doubt", "redo") == 1
    assert "another process replays this bundle" in capsys.readouterr().err
    assert resume(bundle, "--doubt", "redo") == 0
    assert read_journal(bundle / "journal-002.jsonl").outcome == "complete"


def test_an_edited_journal_is_named(bundle, capsys):
    stopped(bundle, "cut")
    path = bundle / "journal-001.jsonl"
    path.write_text(path.read_text().replace('"kind":"done","block":1', '"kind":"done","block":3'))
    capsys.readouterr()
    assert resume(bundle, "--doubt", "redo") == 1
    assert "journal-001.jsonl, line" in capsys.readouterr().err


def test_the_trace_of_the_emulated_machine_is_the_job(bundle, tmp_path, capsys):
    file = tmp_path / "trace.jsonl"
    assert main(["replay", str(bundle), "--port", "emulator", "--arm", "--trace", str(file), "-q"]) == 0
    capsys.readouterr()
    for other in (file, bundle / "journal-001.jsonl"):
        assert main(["trace", "compare", str(bundle), str(other)]) == 0
        assert "in the same order, places and dose" in capsys.readouterr().out
    lines = file.read_text().splitlines()
    lit = [k for k, line in enumerate(lines) if '"kind":"move"' in line and '"beam":"off"' not in line]
    del lines[lit[5]]
    file.write_text("\n".join(lines) + "\n")
    assert main(["trace", "compare", str(bundle), str(file), "--json"]) == 1
    assert not json.loads(capsys.readouterr().out)["same"]
    assert main(["trace", "compare", str(tmp_path), str(file)]) == 2
    assert main(["trace", "compare", str(bundle), str(tmp_path / "none")]) == 2
    assert main(["replay", str(bundle), "--port", "/dev/x", "--trace", "t", "-q"]) == 2


def test_a_camera_on_pictures_of_the_emulated_part(bundle, capsys):
    """Its readings, of rendered pictures, bring a part that bends differently to its shape."""
    pytest.importorskip("cv2")
    words = ["replay", str(bundle), "--port", "emulator", "--arm", "-q", "--json"]
    assert main([*words, "--measure", "virtual-camera:0.85"]) == 0
    assert "a pass is worth 0.8" in json.loads(capsys.readouterr().out)["replay"]
    assert main(["shadow", str(bundle), "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert all(abs(row["angle_deg"] - row["plan_deg"]) < 3.0 for row in values["creases"])


def test_a_camera_file_that_is_missing_or_wrong(bundle, capsys, tmp_path):
    words = ["replay", str(bundle), "--port", "emulator", "--arm", "-q", "--measure"]
    assert main([*words, str(tmp_path / "none.toml")]) == 2
    (tmp_path / "camera.toml").write_text("schema = 1\n[camera]\nsource = 3\n")
    assert main([*words, str(tmp_path / "camera.toml")]) == 2
    assert "$.camera.source" in capsys.readouterr().err
    assert main(["replay", str(bundle), "--port", "emulator", "--frame", "--shadow", "-q"]) == 2
    assert not list(bundle.glob("journal-*"))


def test_shadow_and_measured_passes(bundle, capsys):
    """A part that bends a fifth less than the model: measured, it gets more passes and its goal shape."""
    replay = ["replay", str(bundle), "--port", "emulator", "--arm", "--shadow", "-q", "--json"]
    replay += ["--encoder", "virtual"]
    assert main(replay) == 0
    plain = json.loads(capsys.readouterr().out)["replay"]
    assert "0.000 mm off the path" in plain and "folded 100.0 %" in plain
    assert "encoder: " in plain and "at most 0.00° off" in plain
    assert main([*replay, "--measure", "virtual:0.8"]) == 0
    words = json.loads(capsys.readouterr().out)["replay"]
    assert "a pass is worth 0.8" in words and "measured" in words
    assert main(["shadow", str(bundle), "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["outcome"] == "complete" and values["machine"] == "EMULATED"
    assert all(row["passes"] > 1 for row in values["creases"])
    assert main(["shadow", str(bundle), str(bundle / "journal-001.jsonl")]) == 0
    assert "folded        100.0 %" in capsys.readouterr().out


def test_the_shadow_goes_on_with_the_part_in_the_machine(bundle, capsys):
    """Resumed with a shadow, the twin's part begins as the journals left it and ends as the plan has it."""
    stopped(bundle, "pass")
    capsys.readouterr()
    assert resume(bundle, "--doubt", "done", "--shadow", "--json") == 0
    words = json.loads(capsys.readouterr().out)["replay"]
    assert "shadow: " in words and "0.000 mm off the path" in words and "folded 100.0 %" in words


def test_a_measured_sheet_goes_on_measured(bundle, capsys, monkeypatch):
    import studio.gauges as gauges

    real = gauges._virtual

    def falls_off(*given):
        gauge, calls = real(*given), []

        def measure(crease: int, expected: float) -> tuple[float, float]:
            calls.append(crease)
            if len(calls) == 2:
                raise MachineError("the gauge fell off")
            return gauge(crease, expected)

        return measure

    words = [str(bundle), "--port", "emulator", "-q"]
    monkeypatch.setattr(gauges, "_virtual", falls_off)
    assert main(["replay", *words, "--arm", "--measure", "virtual:1.3"]) == 3
    monkeypatch.setattr(gauges, "_virtual", real)
    capsys.readouterr()
    assert main(["resume", *words]) == 2
    assert "go on with --measure" in capsys.readouterr().err
    assert (
        main(["resume", *words, "--measure", "virtual:1.3", "--shadow", "--encoder", "virtual", "--json"])
        == 0
    )
    told = json.loads(capsys.readouterr().out)["replay"]
    assert (
        "encoder: " in told
        and "measured" in told
        and "a pass is worth 1.2" in told.replace("worth 1.3", "worth 1.2")
    )
    assert read_journal(bundle / "journal-002.jsonl").outcome == "complete"


@pytest.mark.parametrize(
    "words",
    [
        ["--measure", "virtual:x", "--arm"],
        ["--measure", "virtual-camera:0", "--arm"],
        ["--measure", "/dev/none@7", "--arm"],
        ["--measure", "none.toml"],
        ["--measure", "virtual:x", "--arm", "--encoder", "virtual"],
        ["--measure", "virtual"],
        ["--measure", "typed", "--arm"],
        ["--measure", "virtual:9", "--arm"],
    ],
)
def test_measuring_that_makes_no_sense(bundle, words, capsys):
    assert main(["replay", str(bundle), "--port", "emulator", "-q", *words]) == 2
    assert "--measure" in capsys.readouterr().err
    assert not list(bundle.glob("journal-*"))
