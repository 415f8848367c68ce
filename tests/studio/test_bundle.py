"""Bundles are there whole or not at all, and changed files are named."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from studio.bundle import LATER_STAGES, STAGES, create_bundle, edit_bundle
from studio.bundle_check import open_manifest
from studio.errors import BundleError, OutputError
from studio.manifest import MANIFEST_NAME, STAGE_OF, Manifest, file_sha256, read_manifest


def write_bundle(target, *, force=False, names=("goal.ply", "net.fold", "plan.json", "report.html")):
    with create_bundle(target, force=force) as folder:
        manifest = Manifest(seed=7)
        for name in names:
            (folder / name).write_text(f"content of {name}\n")
            manifest.record(folder, STAGE_OF[name], [name])
        (folder / "timing.json").write_text("{}")
        (folder / MANIFEST_NAME).write_bytes(manifest.to_bytes())
    return manifest


def names_in(folder):
    return sorted(p.name for p in folder.iterdir())


def test_a_bundle_appears_whole_and_reads_back(tmp_path):
    target = tmp_path / "deep" / "er" / "part"
    manifest = write_bundle(target)
    assert open_manifest(target) == manifest
    assert names_in(target.parent) == ["part"]
    for name, entry in manifest.files.items():
        assert entry["sha256"] == file_sha256(target / name)
        assert entry["bytes"] == (target / name).stat().st_size


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, MemoryError])
def test_nothing_is_left_of_a_run_that_fails(tmp_path, error):
    target = tmp_path / "part"
    with pytest.raises(error), create_bundle(target) as folder:
        (folder / "goal.ply").write_text("half")
        raise error
    assert names_in(tmp_path) == []


def test_a_failed_run_with_force_leaves_the_old_bundle_as_it_was(tmp_path):
    target = tmp_path / "part"
    manifest = write_bundle(target)
    with pytest.raises(RuntimeError), create_bundle(target, force=True):
        raise RuntimeError
    assert open_manifest(target) == manifest
    assert names_in(tmp_path) == ["part"]


def test_an_existing_bundle_is_replaced_only_with_force(tmp_path):
    target = tmp_path / "part"
    write_bundle(target)
    (target / "journal-001.jsonl").write_text("{}\n")
    with pytest.raises(OutputError, match=r"not empty.*--force"), create_bundle(target):
        pytest.fail("must not come here")
    write_bundle(target, force=True, names=("goal.ply",))
    assert names_in(target) == ["goal.ply", "manifest.json", "timing.json"]
    assert names_in(tmp_path) == ["part"]


def test_an_empty_folder_is_no_bundle_and_may_be_filled(tmp_path):
    target = tmp_path / "part"
    target.mkdir()
    write_bundle(target)
    open_manifest(target)


def test_force_never_removes_what_is_not_ours(tmp_path):
    target = tmp_path / "part"
    write_bundle(target)
    (target / "thesis.tex").write_text("years of work")
    with pytest.raises(OutputError, match=r"thesis\.tex"), create_bundle(target, force=True):
        pytest.fail("must not come here")
    assert (target / "thesis.tex").read_text() == "years of work"


def test_a_file_in_the_way_is_named(tmp_path):
    target = tmp_path / "part"
    target.write_text("a file")
    with pytest.raises(OutputError, match=r"part: a file of that name"), create_bundle(target, force=True):
        pytest.fail("must not come here")
    with pytest.raises(OutputError, match="a part of this path is a file"), create_bundle(target / "below"):
        pytest.fail("must not come here")


def test_an_unwritable_folder_is_named(tmp_path):
    if os.geteuid() == 0:
        target = "/proc/nowhere/part"  # not even root may write here
    else:
        tmp_path.chmod(0o500)
        target = tmp_path / "part"
    with pytest.raises(OutputError, match="cannot write there"), create_bundle(Path(target)):
        pytest.fail("must not come here")


def test_what_a_killed_run_left_is_refused_and_cleaned_up(tmp_path):
    target = tmp_path / "part"
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    left = tmp_path / f".part.partial-{dead.pid}"
    left.mkdir()
    (left / "goal.ply").write_text("half")
    with pytest.raises(BundleError, match="stopped half-way"):
        open_manifest(left)
    write_bundle(target)
    assert names_in(tmp_path) == ["part"]


@pytest.mark.parametrize("name", ["goal.ply", "net.fold", "plan.json", "report.html"])
def test_a_changed_file_is_named(tmp_path, name):
    target = tmp_path / "part"
    write_bundle(target)
    with (target / name).open("a") as stream:
        stream.write(" ")
    with pytest.raises(BundleError, match=rf"{name} \(changed\)"):
        open_manifest(target)
    (target / name).unlink()
    with pytest.raises(BundleError, match=rf"{name} \(missing\)"):
        open_manifest(target)


@pytest.mark.parametrize(
    "content",
    [
        b"", b"{", b"[]", b"null", b"\xff\xfe", b"[" * 100_000, b'{"format": "other"}',
        b'{"format": "metal-blossom/manifest", "version": 99}',
        b'{"format": "metal-blossom/manifest", "version": 1}',
    ],
)  # fmt: skip
def test_a_damaged_manifest_is_refused_in_words(tmp_path, content):
    target = tmp_path / "part"
    write_bundle(target)
    (target / MANIFEST_NAME).write_bytes(content)
    with pytest.raises(BundleError, match=r"manifest\.json"):
        open_manifest(target)


@pytest.mark.parametrize("name", ["../goal.ply", "/etc/passwd"])
def test_a_manifest_does_not_reach_outside_its_folder(tmp_path, name):
    target = tmp_path / "part"
    manifest = write_bundle(target)
    document = json.loads(manifest.to_bytes())
    document["files"][name] = {"sha256": "0" * 64, "bytes": 1, "stage": "net"}
    (target / MANIFEST_NAME).write_text(json.dumps(document))
    with pytest.raises(BundleError, match="inside its folder"):
        open_manifest(target)


@pytest.mark.parametrize("place", [b'"seed": 7', b'"numpy": "', b'"bytes": 2'])
def test_a_changed_manifest_is_refused(tmp_path, place):
    target = tmp_path / "part"
    write_bundle(target)
    content = (target / MANIFEST_NAME).read_bytes()
    at = content.index(place) + len(place) - 1
    digit = b"3" if place[-1:].isdigit() else b'"3'
    (target / MANIFEST_NAME).write_bytes(content[:at] + digit + content[at + 1 :])
    with pytest.raises(BundleError, match=r"manifest\.json was changed"):
        open_manifest(target)


def test_a_bundle_without_manifest_is_replaced_with_force(tmp_path):
    target = tmp_path / "part"
    write_bundle(target, names=tuple(STAGE_OF))
    (target / MANIFEST_NAME).unlink()
    with pytest.raises(BundleError, match="--force"):
        open_manifest(target)
    write_bundle(target, force=True)
    open_manifest(target)


@pytest.mark.parametrize("place", [".", "..", ""])
def test_the_folder_one_is_in_is_not_replaced(tmp_path, monkeypatch, place):
    inner = tmp_path / "outer" / "inner"
    inner.mkdir(parents=True)
    monkeypatch.chdir(inner)
    with pytest.raises(OutputError, match="that you are in"), create_bundle(Path(place), force=True):
        pytest.fail("must not come here")
    assert names_in(inner.parent) == ["inner"]


def test_a_folder_is_only_looked_into_as_far_as_is_needed(tmp_path, monkeypatch):
    target = tmp_path / "part"
    for number in range(30):
        (target / f"{number:02d}").mkdir(parents=True)
        (target / f"{number:02d}" / "thesis.tex").write_text("years of work")
    seen = []
    walk = os.walk
    monkeypatch.setattr(os, "walk", lambda *a, **k: (seen.append(e) or e for e in walk(*a, **k)))
    with pytest.raises(OutputError, match="not empty"), create_bundle(target):
        pytest.fail("must not come here")
    assert len(seen) <= 2
    with pytest.raises(OutputError, match=r"thesis\.tex.* and more"), create_bundle(target, force=True):
        pytest.fail("must not come here")
    assert len(seen) <= 8


def test_a_bundle_behind_a_link_is_replaced_where_it_lies(tmp_path):
    write_bundle(tmp_path / "far" / "part")
    (tmp_path / "link").symlink_to(tmp_path / "far" / "part")
    write_bundle(tmp_path / "link", force=True, names=("goal.ply",))
    assert (tmp_path / "link").is_symlink()
    assert set(open_manifest(tmp_path / "far" / "part").files) == {"goal.ply"}
    assert names_in(tmp_path) == ["far", "link"]


def test_places_that_are_no_bundles_are_told_apart(tmp_path):
    with pytest.raises(BundleError, match="no such bundle"):
        open_manifest(tmp_path / "absent")
    (tmp_path / "file").write_text("")
    with pytest.raises(BundleError, match="not a folder"):
        open_manifest(tmp_path / "file")
    with pytest.raises(BundleError, match="no complete bundle"):
        open_manifest(tmp_path)


def test_a_stage_that_runs_again_removes_what_is_stale(tmp_path):
    target = tmp_path / "part"
    write_bundle(target, names=tuple(STAGE_OF))
    with edit_bundle(target, "plan") as (folder, manifest):
        assert (folder / "net.fold").read_text() == "content of net.fold\n"
        (folder / "plan.json").write_text("new")
        manifest.record(folder, "plan", ["plan.json"])
    now = open_manifest(target)
    assert set(now.files) == {n for n, s in STAGE_OF.items() if s not in LATER_STAGES["plan"]}
    assert (target / "plan.json").read_text() == "new"
    assert names_in(target) == sorted([*now.files, MANIFEST_NAME, "timing.json"])
    assert names_in(tmp_path) == ["part"]


def test_a_stage_that_fails_changes_nothing(tmp_path):
    target = tmp_path / "part"
    manifest = write_bundle(target, names=tuple(STAGE_OF))
    with pytest.raises(ValueError, match="no plan"), edit_bundle(target, "plan") as (folder, _):
        (folder / "plan.json").write_text("half")
        raise ValueError("no plan")
    assert open_manifest(target) == manifest
    assert names_in(tmp_path) == ["part"]


def test_a_stage_refuses_a_changed_bundle(tmp_path):
    target = tmp_path / "part"
    write_bundle(target)
    (target / "net.fold").write_text("other")
    with pytest.raises(BundleError, match=r"net\.fold"), edit_bundle(target, "plan"):
        pytest.fail("must not come here")


def test_later_stages_follow_the_order_of_the_run():
    for number, stage in enumerate(STAGES):
        assert set(LATER_STAGES[stage]) <= set(STAGES[number + 1 :])


def test_the_manifest_is_the_same_whatever_the_order_of_entries(tmp_path):
    (tmp_path / "b").write_text("b")
    (tmp_path / "a").write_text("a")
    one, two = Manifest(), Manifest()
    one.record(tmp_path, "net", ["a", "b"])
    two.record(tmp_path, "net", ["b", "a"])
    assert one.to_bytes() == two.to_bytes()
    (tmp_path / MANIFEST_NAME).write_bytes(one.to_bytes())
    assert read_manifest(tmp_path) == two
