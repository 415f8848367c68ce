"""The command line: help texts, mistakes in usage, exit codes. Nothing here needs a whole run."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import typing

import pytest
from rich.console import Console

from planner.fold_problem import RULES
from studio import commands_make, pipeline
from studio.cli import app, main
from studio.commands_make import default_output
from studio.flags import Rule

COMMANDS = (
    "make",
    "check",
    "net",
    "plan",
    "certify",
    "validate",
    "job",
    "replay",
    "resume",
    "shadow",
    "trace",
    "replay-dump",
    "report",
    "view",
    "export",
    "guide",
    "compare",
    "explain",
    "scatter",
    "bend",
    "testgrid",
    "calibrate",
    "emulate",
    "rigs",
    "materials",
    "demo",
    "bench",
    "config",
    "completion",
)
BLOSSOM = [sys.executable, "-m", "studio.cli"]


@pytest.fixture(autouse=True)
def plain_terminal(monkeypatch, tmp_path):
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.chdir(tmp_path)
    app.console = Console()  # each command keeps the first one it meets, with the width of that time
    yield
    app.console = None
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.mark.parametrize(
    "words", [(), *((name,) for name in COMMANDS)], ids=lambda w: w[0] if w else "blossom"
)
def test_help(words, snapshot, capsys):
    assert main([*words, "--help"]) == 0
    assert capsys.readouterr().out == snapshot


def test_all_commands_are_there():
    assert [name for name in app if not name.startswith("-")] == list(COMMANDS)


def test_rules_are_those_of_the_planner():
    assert typing.get_args(Rule) == RULES


@pytest.mark.parametrize(
    "line",
    [
        "make", "mak bunny.obj", "make a.obj b.obj", "make a.obj --bogus 3", "make a.obj --size",
        "make a.obj --size nan", "make a.obj --size -3", "make a.obj --size inf", "make a.obj --scale 0",
        "make a.obj --faces 0", "make a.obj --faces many", "make a.obj --seed -1",
        "make a.obj --without gravity",
        "make a.obj --rig gbrl-4axis", "make a.obj --material 305", "make a.obj --rig no/such/rig.toml",
        "make a.obj --thickness 40", "plan nowhere", "validate nowhere", "job nowhere", "report nowhere",
        "replay nowhere", "replay nowhere --port emulator", "replay nowhere --port emulator --arm --frame",
    ],
)  # fmt: skip
def test_mistakes_in_usage(line, snapshot, capsys):
    assert main(line.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err == snapshot
    assert err.count("\n") == 1


def test_a_mistake_as_json(capsys):
    assert main(["make", "a.obj", "--json", "--size", "-1"]) == 2
    out, err = capsys.readouterr()
    values = json.loads(out)
    assert values["exit_code"] == 2
    assert values["error"]["message"] == err.strip()


@pytest.mark.parametrize("command", ["rigs", "materials"])
def test_lists(command, capsys):
    assert main([command]) == 0
    text = capsys.readouterr().out
    assert main([command, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["format"] == f"metal-blossom/{command}"
    assert document[command]
    for row in document[command]:
        assert all(str(value) in text for value in row.values())


def raising(error):
    def run(*_words, **_named):
        raise error

    return run


@pytest.mark.parametrize(
    ("error", "code"), [(KeyboardInterrupt(), 130), (RuntimeError("boom"), 70), (MemoryError(), 2)]
)
def test_no_error_ends_in_a_traceback(error, code, monkeypatch, capsys):
    monkeypatch.setattr(pipeline, "make", raising(error))
    assert main(["make", "a.obj"]) == code
    assert "Traceback" not in capsys.readouterr().err
    assert main(["make", "a.obj", "--debug"]) == code
    assert "Traceback" in capsys.readouterr().err


def test_a_reader_that_goes_away_is_no_error():
    done = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m studio.cli materials | true; echo ${{PIPESTATUS[0]}}"],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.stderr == ""
    assert done.stdout.strip() in ("0", "2")


def test_sigterm_cleans_up_as_ctrl_c_does(tmp_path):
    code = (
        # a suite that was started in the background passes an ignored SIGINT on
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "signal.signal(signal.SIGHUP, signal.SIG_DFL)\n"
        "import sys, time; from pathlib import Path; from studio import cli, pipeline\n"
        "from studio.bundle import create_bundle\n"
        "def run(target, *a, **k):\n"
        "    with create_bundle(Path(target)) as folder:\n"
        "        print('ready', flush=True); time.sleep(60)\n"
        "pipeline.make = run; sys.exit(cli.main(['make', 'a.obj', '-o', 'out']))\n"
    )
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        process = subprocess.Popen(
            [sys.executable, "-c", code],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        _, err = process.communicate(timeout=30)
        assert process.returncode == 130
        assert err.startswith("stopped:")
        assert os.listdir(tmp_path) == []  # noqa: PTH208


def test_ctrl_c_while_the_command_loads_ends_in_words():
    code = (
        "import builtins, sys; load = builtins.__import__\n"
        "def slow(name, *a, **k):\n"
        "    if name.startswith('cyclopts'): raise KeyboardInterrupt\n"
        "    return load(name, *a, **k)\n"
        "from studio.__main__ import main; builtins.__import__ = slow; sys.exit(main())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 130
    assert done.stderr.startswith("stopped:")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("mesh", "folder"),
    [
        ("bunny.obj", "bunny"),
        ("a/b/part.v2.stl", "part.v2"),
        ("noend", "noend-bundle"),
        (".hidden", "hidden"),
    ],
)
def test_the_bundle_is_named_after_the_mesh(mesh, folder):
    from pathlib import Path

    assert str(default_output(Path(mesh))) == folder


@pytest.mark.parametrize(
    ("verdict", "code"), [("pass", 0), ("not validated", 0), ("contact", 1), ("numerical", 1)]
)
def test_the_exit_code_follows_the_verdict(verdict, code):
    from tests.studio.report_page import small_summary

    assert commands_make.exit_code(small_summary(verdict=verdict)) == code


def test_the_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("metal-blossom ")
