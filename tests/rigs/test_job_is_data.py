"""A job file is data: no field of it runs a command, leaves its folder, or lights more than it says."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from rigs.errors import JobError
from rigs.gcode import write_gcode
from rigs.job_file import read_job, write_job
from rigs.replay_blocks import replay_job
from rigs.replay_checks import check_job
from tests.rigs.fault_runs import check_light, fault_job, same, simulated, strokes, wanted_strokes
from tests.rigs.replay_jobs import RIG

NASTY = [
    "$(touch owned)", "`touch owned`; touch owned", "../../../../tmp/owned", "\nM3 S1000\n",
    ")\nM4S1000\nG1X1F1\n(", "\x18~", "$H\n$X", "%n%s", "{0.__class__}", "__import__('os').abort()",
    "\x00", "\u2028M3", "A" * 5000,
]  # fmt: skip


def with_text(field: str, text: str):
    job = fault_job()
    if field == "rig_name":
        return replace(job, rig_name=text)
    if field == "notices":
        return replace(job, notices=(text,))
    if field == "hash":
        return replace(job, hashes={**job.hashes, "plan": text})
    if field == "name of a hash":
        return replace(job, hashes={**job.hashes, text: "ab"})
    if field == "rotary word":
        return replace(job, style=replace(job.style, rotary_word=text))
    return replace(job, blocks=tuple(replace(b, text=text) for b in job.blocks))


@pytest.mark.parametrize("field", ["rig_name", "notices", "hash", "name of a hash", "rotary word", "text"])
def test_no_text_of_a_job_does_anything(tmp_path, field):
    plain = {line for block in replay_job(fault_job()).blocks for line in block.lines}
    for number, text in enumerate(NASTY):
        folder = tmp_path / str(number)
        folder.mkdir()
        try:
            made = with_text(field, text)
            write_job(made, folder / "job.json")
            (folder / "job.gcode").write_text(write_gcode(made))
            job = read_job(folder / "job.json", folder / "job.gcode")
            run = simulated(replay_job(job), folder / "journal.jsonl")
        except JobError:
            run = None
        if run is not None and run.error is None:
            data = bytes(byte for _, byte in run.link.sent).replace(b"?", b"").decode("ascii")
            assert set(data.split("\n")) <= plain | {"G4P0.01", "G4 P0.01", "$I", "$$", "$#", "$G", "M5", ""}
            wanted = wanted_strokes(job, range(len(job.blocks)))
            assert all(same(a, b) for a, b in zip(strokes(run), wanted, strict=True))
            check_light(run)
        elif run is not None:
            assert isinstance(run.error, JobError), (field, text, run.error)
            assert not run.lit
        assert {p.name for p in folder.iterdir()} <= {"job.json", "job.gcode", "journal.jsonl"}
    assert {p.name for p in tmp_path.iterdir()} == {str(n) for n in range(len(NASTY))}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"speed_mm_s": 0.02}, "light for"),
        ({"beam_s": 0.001}, "light for"),
        ({"speed_mm_s": 4000.0}, "faster than 200 mm/s with the light on"),
        ({"s_word": 999.0}, "at most S"),
        ({"rotary_rad": 3.0}, None),
        ({"beam_s": 99.0}, "5 s at most may be in flight"),
    ],
)
def test_what_a_block_says_about_itself_is_not_believed(change, words):
    job = fault_job()
    number = next(k for k, b in enumerate(job.blocks) if b.lit)
    blocks = tuple(replace(b, **change) if k == number else b for k, b in enumerate(job.blocks))
    changed = replay_job(replace(job, blocks=blocks))
    if words is None:  # a beam block has no word for the rotary: it cannot turn with the light on
        assert [b.lines for b in changed.blocks] == [b.lines for b in replay_job(job).blocks]
        return
    with pytest.raises(JobError, match=words):
        check_job(changed, RIG)


def clamped(polygon):
    import msgspec

    sheet = msgspec.structs.replace(RIG.sheet, clamp_polygons_mm=(polygon,))
    return msgspec.structs.replace(RIG, sheet=sheet)


def test_light_over_a_clamp_is_refused_before_anything_is_sent():
    plan = replay_job(fault_job())
    over = clamped(((-1.0, -3.0), (1.0, -3.0), (1.0, -1.0), (-1.0, -1.0)))
    with pytest.raises(JobError, match="lights clamp 0 of the sheet"):
        check_job(replace(plan, rig_sha256=over.sha256), over)
    beside = clamped(((50.0, 50.0), (60.0, 50.0), (60.0, 60.0), (50.0, 60.0)))
    check_job(replace(plan, rig_sha256=beside.sha256), beside)
    # the other side of the sheet: the same place of the machine is another place of the sheet
    mirrored = clamped(((-1.0, -2.5), (1.0, -2.5), (1.0, -2.3), (-1.0, -2.3)))
    check_job(replace(plan, rig_sha256=mirrored.sha256), mirrored)


def test_a_job_over_a_clamp_is_not_made():
    from rigs.job_build import make_job
    from rigs.material import load_material
    from tests.rigs.made_jobs import made
    from twin.plan_process import plan_process

    plan, _, _, job = made("star", "grbl-4axis")
    lit = next(b for b in job.blocks if b.kind == "pass")
    x0, y0, _ = RIG.rotary.axis_point_mm
    x, y = (0.5 * (a + b) for a, b in zip(lit.path[0][:2], lit.path[-1][:2], strict=True))
    x, y = x - x0, y - y0
    over = clamped(((x - 0.5, y - 0.5), (x + 0.5, y - 0.5), (x + 0.5, y + 0.5), (x - 0.5, y + 0.5)))
    with pytest.raises(JobError, match=r"would fall on\s+clamp 0 of the sheet"):
        make_job(plan, plan_process(plan, over, load_material("304")), over, load_material("304"))


def test_everything_that_listens_is_on_the_loopback_address(repository):
    """No package of the product opens a port to the network."""
    found = 0
    for package in ("planner", "rigs", "twin", "studio", "models"):
        for path in (repository / package).rglob("*.py"):
            text = path.read_text("utf-8")
            assert not re.search(r"\.bind\(|HTTPServer|start_server", text), path
            for call in re.findall(r"create_server\(([^)]*)\)", text):
                found += 1
                assert call.startswith('("127.0.0.1"'), f"{path}: {call}"
    assert found >= 1  # the emulated machine, for one
