"""The viewer that ships is the one that its sources and locked packages give; it carries its licences."""

from __future__ import annotations

import json
import shutil
import subprocess

import pytest


@pytest.fixture(scope="module")
def folder(repository):
    return repository / "studio" / "viewer"


def test_the_built_viewer_is_what_the_sources_give(repository, folder, tmp_path):
    for program in ("node", "npm"):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed, so the viewer cannot be built again and compared")
    built = tmp_path / "report_viewer.js"
    done = subprocess.run([folder / "build", built], capture_output=True, text=True, timeout=280)
    if done.returncode != 0 and any(
        word in done.stderr for word in ("ENOTFOUND", "EAI_AGAIN", "ECONN", "ETIMEDOUT")
    ):
        pytest.skip(
            f"npm's registry cannot be reached, so the viewer was not built again: {done.stderr[-300:]}"
        )
    assert done.returncode == 0, done.stderr[-3000:]
    assert built.read_bytes() == (repository / "studio" / "report_viewer.js").read_bytes(), (
        "studio/report_viewer.js is not what studio/viewer gives: run make viewer and commit it"
    )


def test_the_built_viewer_carries_the_licence_of_what_it_contains(repository):
    text = (repository / "studio" / "report_viewer.js").read_text(encoding="utf-8")
    assert text.startswith("/*")
    words = " ".join(text[: text.index("*/")].split())
    for part in (
        "three.js 0.187.0", "The MIT License", "three.js authors",
        "Permission is hereby granted, free of charge",
        'THE SOFTWARE IS PROVIDED "AS IS"',
    ):  # fmt: skip
        assert part in words
    assert "</script" not in text.lower()


def test_packages_are_locked_with_their_hashes(folder):
    package = json.loads((folder / "package.json").read_text())
    lock = json.loads((folder / "package-lock.json").read_text())["packages"]
    wanted = package["dependencies"] | package["devDependencies"]
    assert {name: lock[f"node_modules/{name}"]["version"] for name in wanted} == wanted
    assert all(entry.get("integrity") for name, entry in lock.items() if name)
