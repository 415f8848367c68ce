"""What README and docs tell a user to type does what it says."""

from __future__ import annotations

import functools
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from models.goals import goal_path

REPOSITORY = Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BLOSSOM = str(Path(sys.executable).parent / "blossom")


def blocks(language: str) -> list[tuple[str, str]]:
    """(document, text) of every fenced block of a language in the documents for users."""
    files = sorted([*REPOSITORY.glob("*.md"), *(REPOSITORY / "docs").rglob("*.md")])
    return [
        (str(file.relative_to(REPOSITORY)), text)
        for file in files
        for found, text in BLOCK.findall(file.read_text(encoding="utf-8"))
        if found == language
    ]


def commands(program: str) -> list[str]:
    """Every command of a program in the documents, each once."""
    lines = (line.partition("#")[0].strip() for _, text in blocks("console") for line in text.splitlines())
    return sorted({line for line in lines if line.split()[:1] == [program]})


def subcommands() -> set[str]:
    """Every subcommand that the documents name anywhere in the text."""
    files = [*REPOSITORY.glob("*.md"), *(REPOSITORY / "docs").rglob("*.md")]
    text = "\n".join(file.read_text(encoding="utf-8") for file in files)
    return set(re.findall(r"`blossom ([a-z]+)", text)) | set(
        re.findall(r"^# blossom ([a-z]+)", text, re.MULTILINE)
    )


@pytest.fixture
def desk(tmp_path, monkeypatch) -> Path:
    """A folder with the files that the documents speak of."""
    shutil.copy(goal_path("flower"), tmp_path / "bunny.obj")
    shutil.copy(goal_path("star"), tmp_path / "star.obj")
    (tmp_path / "out" / "bunny").mkdir(parents=True)
    for name in ("bracket.stl", "scan.stl", "my-rig.toml"):
        (tmp_path / name).write_text("only there to be named\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_documents_name_all_commands():
    fixed = {
        "make",
        "check",
        "net",
        "plan",
        "validate",
        "job",
        "replay",
        "report",
        "rigs",
        "materials",
        "demo",
    }
    assert fixed <= subcommands()


@pytest.mark.parametrize("line", commands("blossom"))
def test_command_line_is_understood(line, desk):
    from studio.cli import app

    typed = line.partition(" > ")[0]  # where a shell sends the output
    function, bound, _ = app.parse_args(shlex.split(typed)[1:], exit_on_error=False, print_error=False)
    assert callable(function)
    assert bound is not None


@pytest.mark.parametrize("name", sorted(subcommands()))
def test_each_named_command_has_help(name):
    assert name in help_of(name)


@functools.cache
def help_of(name: str) -> str:
    done = subprocess.run([BLOSSOM, name, "--help"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    "page", sorted((REPOSITORY / "docs" / "commands").glob("*.md")), ids=lambda p: p.stem
)
def test_page_names_the_flags_that_help_names(page):
    """All flags of the page's own commands, and no flag that neither they nor ``make`` know."""
    text = page.read_text(encoding="utf-8")
    flags = re.compile(r"(?<![\w-])--[a-z]+(?:-[a-z]+)*")
    own = set()
    for name in re.findall(r"blossom ([a-z]+(?:-[a-z]+)*)", text.partition("\n")[0]):
        own |= set(flags.findall(help_of(name)))
    assert own, "the heading names the command"
    named = set(flags.findall(text))
    assert own <= named
    assert named <= own | set(flags.findall(help_of("make")))


@pytest.mark.parametrize("line", commands("make"))
def test_make_target_exists(line):
    dry = [*shlex.split(line), "--dry-run"]
    done = subprocess.run(dry, cwd=REPOSITORY, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def test_the_stages_run_one_after_another_as_documented(desk):
    for line in (
        "blossom check bunny.obj",
        "blossom net bunny.obj -o out/flower --method steepest",
        "blossom plan out/flower --planner fp",
        "blossom validate out/flower",
        "blossom job out/flower",
        "blossom replay out/flower --port emulator --dry-run",
        "blossom report out/flower",
    ):
        done = subprocess.run(
            [BLOSSOM, *shlex.split(line)[1:]], capture_output=True, text=True, timeout=300, cwd=desk
        )
        assert done.returncode == 0, f"{line}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    held = {file.name for file in (desk / "out" / "flower").iterdir()}
    formats = (REPOSITORY / "docs" / "formats.md").read_text(encoding="utf-8")
    table = formats.partition("| file |")[2].partition("\n\n")[0]
    assert {
        name for row in table.splitlines() for name in re.findall(r"`([\w.]+)`", row.split("|")[1])
    } <= held


@pytest.mark.parametrize("source", [text for name, text in blocks("python") if name == "README.md"])
def test_python_example_runs_as_it_stands(source, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", source], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert "verdict: pass" in done.stdout
    for name in set(re.findall(r'Path\("([\w.]+)"\)', source)):
        assert (tmp_path / name).stat().st_size > 0
