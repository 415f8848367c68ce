"""``job.json``: exact round trip, and every tampering refused in words."""

from __future__ import annotations

import json

import pytest

from rigs.errors import JobError
from rigs.gcode import write_gcode
from rigs.job_file import read_job, write_job
from tests.rigs.made_jobs import made


@pytest.fixture(scope="module")
def job():
    return made("star", tilt_deg=20.0)[3]


@pytest.fixture
def files(job, tmp_path):
    write_job(job, tmp_path / "job.json")
    (tmp_path / "job.gcode").write_text(write_gcode(job), "ascii")
    return tmp_path / "job.json", tmp_path / "job.gcode"


def test_the_round_trip_is_exact(job, files):
    back = read_job(*files)
    assert back.blocks == job.blocks
    assert back.style == job.style
    assert back.hashes == job.hashes
    assert back.pattern == job.pattern
    assert job.pattern["largest_shift_mm"] > 0.0
    assert back.sha256 == job.sha256


def test_the_same_job_gives_the_same_bytes(job, files, tmp_path):
    write_job(job, tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == files[0].read_bytes()


def test_the_index_points_at_the_lines(job, files):
    data = json.loads(files[0].read_text())
    lines = files[1].read_text().split("\n")
    columns = data["columns"]
    assert len(data["rows"]) == len(job.blocks) == data["totals"]["blocks"]
    for row in data["rows"]:
        block = dict(zip(columns, row, strict=True))
        mine = lines[block["first_line"] - 1 : block["last_line"]]
        assert mine[-1].startswith("G4P")
        assert (mine[0] == "M4S0") == (block["kind"] in ("pass", "cut"))
    assert data["rig_sha256"] == job.hashes["rig"]
    assert data["plan_sha256"] == "ab" * 32


def test_it_stays_small(job, files):
    assert files[0].stat().st_size + files[1].stat().st_size < 600 * len(job.blocks)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"style": ', '"stile": '),
        ('"metal-blossom/job"', '"other"'),
        ('"version": 1', '"version": 9'),
        ('["pass"', '["burn"'),
        ('"rows": [', '"rows": [["goto"],'),
        ('"columns": [', '"columns": ["x",'),
        ("{", "["),
        ('"line_chars": 78', '"line_chars": 79'),
    ],
)
def test_a_changed_file_is_refused(files, old, new):
    text = files[0].read_text()
    assert old in text
    files[0].write_text(text.replace(old, new, 1))
    with pytest.raises(JobError, match=r"job\.json"):
        read_job(*files)


def test_a_changed_power_is_refused(files):
    data = json.loads(files[0].read_text())
    row = next(r for r in data["rows"] if r[0] == "pass")
    row[data["columns"].index("s")] += 1.0
    files[0].write_text(json.dumps(data))
    with pytest.raises(JobError, match="hash"):
        read_job(files[0])


def test_changed_gcode_is_refused(files):
    files[1].write_text(files[1].read_text().replace("M5\n", "\n", 1))
    with pytest.raises(JobError, match=r"job\.gcode"):
        read_job(*files)
    read_job(files[0])


def test_missing_and_foreign_files_are_named(files, tmp_path):
    with pytest.raises(JobError, match=r"none\.json"):
        read_job(tmp_path / "none.json")
    with pytest.raises(JobError, match=r"none\.gcode"):
        read_job(files[0], tmp_path / "none.gcode")
    (tmp_path / "bin.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(JobError, match=r"bin\.json"):
        read_job(tmp_path / "bin.json")
    (tmp_path / "deep.json").write_text("[" * 100_000)
    with pytest.raises(JobError, match=r"deep\.json"):
        read_job(tmp_path / "deep.json")
