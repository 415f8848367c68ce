"""Wheel and sdist install into an empty environment and run the demo there, away from the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow


def run(command, cwd: Path, **more) -> str:
    environment = {
        k: v for k, v in os.environ.items() if k not in {"PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV"}
    }
    done = subprocess.run(
        [str(word) for word in command], cwd=cwd, capture_output=True, text=True, env=environment, **more
    )
    assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def built(repository, tmp_path_factory) -> Path:
    """Folder with wheel and sdist, built from the files that git knows."""
    source = tmp_path_factory.mktemp("source")
    out = tmp_path_factory.mktemp("dist")
    names = run(["git", "ls-files", "-z"], repository).split("\0")
    for name in filter(None, names):
        target = source / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes((repository / name).read_bytes())
    run([sys.executable, "-m", "build", "--outdir", out, source], source, timeout=900)
    return out


def test_the_wheel_holds_all_data(repository, built):
    (wheel,) = built.glob("*.whl")
    held = set(zipfile.ZipFile(wheel).namelist())
    wanted = {
        str(file.relative_to(repository))
        for package in ("planner", "rigs", "twin", "studio", "models")
        for pattern in ("*.py", "*.toml", "*.xml", "*.obj", "*.html", "*.js", "*.css", "py.typed")
        for file in (repository / package).rglob(pattern)
    }
    assert wanted - held == set()
    assert not [name for name in held if name.startswith(("tests/", "benchmarks/", "docs/"))]
    assert any(name.endswith("licenses/LICENSE") for name in held)


@pytest.mark.parametrize("pattern", ["*.whl", "*.tar.gz"])
def test_it_installs_into_an_empty_environment_and_runs_the_demo(built, tmp_path, pattern):
    (package,) = built.glob(pattern)
    venv.create(tmp_path / "venv", with_pip=True)
    binaries = tmp_path / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    run([binaries / "python", "-m", "pip", "install", "--quiet", package], elsewhere, timeout=1200)
    where = run([binaries / "python", "-c", "import planner; print(planner.__file__)"], elsewhere)
    assert Path(where.strip()).is_relative_to(tmp_path / "venv")
    run([binaries / "blossom", "--version"], elsewhere)
    said = run([binaries / "blossom", "demo"], elsewhere, timeout=600)
    assert "pass" in said
