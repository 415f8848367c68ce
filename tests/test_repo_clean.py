"""The repository holds nothing that does not belong there."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path

import pytest

LARGEST_FILE_BYTES = 1_000_000
LONGEST_MODULE_LINES = 400

# Homes and work folders of somebody's machine; written so that this file does not match itself.
PRIVATE_PATHS = re.compile(
    r"(?<![\w.])/(?:hom[e]/[a-z]|roo[t]/\.|User[s]/[A-Za-z]|wor[k]/|far[m]/|op[t]/(?!homebrew))|[A-Z]:\\\\?User[s]"
)
OPEN_ENDS = re.compile(r"\b(?:TOD[O]|FIXM[E]|XX[X]|HAC[K])\b")


def tracked(repository: Path) -> list[Path]:
    if not (repository / ".git").exists():
        pytest.skip("not a git checkout (an unpacked sdist has no list of files)")
    listing = subprocess.run(
        ["git", "ls-files", "-z"], cwd=repository, capture_output=True, text=True, check=True
    ).stdout
    return [repository / name for name in listing.split("\0") if name and (repository / name).is_file()]


def texts(repository: Path) -> list[tuple[Path, str]]:
    out = []
    for file in tracked(repository):
        data = file.read_bytes()
        if b"\0" not in data:
            out.append((file.relative_to(repository), data.decode("utf-8")))
    return out


def test_no_path_of_a_private_machine(repository):
    found = [
        f"{name}:{number}: {line.strip()[:100]}"
        for name, text in texts(repository)
        for number, line in enumerate(text.splitlines(), 1)
        if PRIVATE_PATHS.search(line)
    ]
    assert found == []


def test_the_pattern_knows_private_paths():
    for text in ("see /ho" + "me/ann/x", "/wo" + "rk/main", "/ro" + "ot/.cache", "C:\\Us" + "ers\\ann"):
        assert PRIVATE_PATHS.search(text), text
    for text in ("../shared/meshes", "/dev/ttyUSB0", "frame/work/area", "https://a.org/home/x"):
        assert not PRIVATE_PATHS.search(text), text


def test_no_large_files(repository):
    sizes = {str(file.relative_to(repository)): file.stat().st_size for file in tracked(repository)}
    assert {name: size for name, size in sizes.items() if size > LARGEST_FILE_BYTES} == {}


def test_modules_are_short(repository):
    long = {
        str(name): lines
        for name, text in texts(repository)
        if name.suffix == ".py" and (lines := len(text.splitlines())) > LONGEST_MODULE_LINES
    }
    assert long == {}, "split these modules: each should have one reason to change"


def test_no_open_ends_in_code(repository):
    found = [
        f"{name}:{number}"
        for name, text in texts(repository)
        if name.suffix in {".py", ".js", ".toml", ".xml"}
        for number, line in enumerate(text.splitlines(), 1)
        if OPEN_ENDS.search(line)
    ]
    assert found == []


def test_every_type_ignore_names_its_code(repository):
    found = [
        f"{name}:{number}"
        for name, text in texts(repository)
        if name.suffix == ".py"
        for number, line in enumerate(text.splitlines(), 1)
        if re.search(r"#\s*type:\s*ignore(?!\[)", line)
    ]
    assert found == []


def test_no_build_products_are_tracked(repository):
    names = [file.relative_to(repository) for file in tracked(repository)]
    products = {".pyc", ".pyo", ".nbi", ".nbc", ".so", ".whl", ".gz"}
    assert [str(n) for n in names if n.suffix in products or "egg-info" in str(n)] == []


def test_the_version_stands_in_the_changelog(repository):
    project = tomllib.loads((repository / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    changelog = (repository / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(rf"^## {re.escape(project['version'])}\b", changelog, re.MULTILINE)
