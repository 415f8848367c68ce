"""``blossom.toml``: what it sets counts, what is typed wins, and every mistake in it is named."""

from __future__ import annotations

import json
import shutil
import subprocess

import pytest

from models.goals import goal_path
from studio.cli import app, main
from studio.config_file import NEVER, all_flags


@pytest.fixture
def desk(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "parts").mkdir()
    shutil.copy(goal_path("bracket"), tmp_path / "parts" / "bracket.obj")
    return tmp_path / "parts"


def bound(words):
    """The arguments that a command would get."""
    return app.parse_args(words, exit_on_error=False, print_error=False)[1].arguments


def test_flags_of_the_file_beside_the_mesh_count_and_what_is_typed_wins(desk):
    (desk / "blossom.toml").write_text(
        'thickness = 0.2\nmaterial = "316"\n[make]\nseed = 5\nrelief = "off"\n'
    )
    chosen = bound(["make", "parts/bracket.obj", "--material", "304"])
    assert (chosen["machine"].thickness, chosen["machine"].material) == (0.2, "304")
    assert (chosen["seed"], chosen["bend"].relief) == (5, "off")
    assert "seed" not in bound(["net", "parts/bracket.obj"])  # the heading is that of make
    assert bound(["net", "parts/bracket.obj"])["machine"].thickness == 0.2
    assert "machine" not in bound(["bend", "--material", "304", "--thickness", "0.1", "--power", "5",
                                   "--speed", "100", "--spot", "0.1"])  # fmt: skip


def test_a_bundle_takes_the_file_beside_its_folder(desk):
    (desk / "part").mkdir()
    (desk / "part" / "blossom.toml").write_text("seed = 9\n")
    assert "seed" not in bound(["plan", "parts/part"])
    (desk / "blossom.toml").write_text("seed = 7\n")
    assert bound(["plan", "parts/part"])["seed"] == 7


def test_profiles_lie_where_the_file_lies(desk):
    (desk / "blossom.toml").write_text('rig = "my-rig.toml"\nmaterial = "304/full-hard"\n')
    machine = bound(["make", "parts/bracket.obj"])["machine"]
    assert machine.rig == "parts/my-rig.toml"
    assert machine.material == "304/full-hard"


def test_a_whole_run_uses_it(desk, capsys):
    (desk / "blossom.toml").write_text("size = 30\n[check]\nthickness = 0.2\n")
    assert main(["check", "parts/bracket.obj", "--json"]) == 0
    assert max(json.loads(capsys.readouterr().out)["size_mm"]) == pytest.approx(30.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("arm = true\n", "arm cannot be set in a file"),
        ("[make]\nforce = true\n", "[make] force cannot be set in a file"),
        ("sede = 1\n", "sede is no flag of any command; did you mean seed?"),
        ("[make]\nport = 'x'\n", "[make] port is no flag of blossom make"),
        ("[maek]\nseed = 1\n", "[maek] is no command; did you mean make?"),
        ("seed = \n", "not valid TOML"),
        ("seed = 'many'\n", "many"),
        ("seed = -1\n", "0 or more"),
        ("thickness = nan\n", "finite"),
        ("prefer = 'euros'\n", "euros"),
    ],
)
def test_mistakes_are_named_and_nothing_is_done(desk, text, words, capsys):
    (desk / "blossom.toml").write_text(text)
    assert main(["make", "parts/bracket.obj", "-o", "out"]) == 2
    said = capsys.readouterr().err
    assert words in said and "blossom.toml" in said and "Traceback" not in said
    assert not (desk.parent / "out").exists()


def test_bytes_that_are_no_text_are_told(desk, capsys):
    (desk / "blossom.toml").write_bytes(b"seed = \xff\n")
    assert main(["config", "parts/bracket.obj"]) == 2
    assert "not UTF-8" in capsys.readouterr().err


def test_config_shows_where_values_come_from(desk, capsys):
    (desk / "blossom.toml").write_text("seed = 5\n[make]\nwithout = ['sight']\n")
    assert main(["config", "parts/bracket.obj", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    rows = {row["flag"]: row for row in shown["flags"]}
    assert shown["file"].endswith("blossom.toml")
    assert (rows["seed"]["value"], rows["seed"]["from"]) == (5, "blossom.toml")
    assert rows["without"]["value"] == ["sight"]
    assert (rows["rig"]["value"], rows["rig"]["from"]) == ("grbl-4axis", "")
    assert not set(NEVER) & set(rows)
    assert main(["config", "--command", "plan"]) == 0
    assert "no such file, usual values" in capsys.readouterr().out
    assert main(["config", "--command", "plam"]) == 2
    assert "plan" in capsys.readouterr().err


def test_nothing_that_arms_or_replaces_can_be_set():
    flags = set().union(*all_flags(app).values())
    assert {"arm", "force", "yes", "output"} & flags <= set(NEVER)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "powershell"])
def test_completion_knows_commands_and_flags(shell, capsys):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert "blossom" in script
    assert "scatter" in script
    assert "start-temperature" in script


def test_the_bash_script_is_one_and_completes(tmp_path, capsys):
    assert main(["completion", "bash"]) == 0
    script = tmp_path / "blossom"
    script.write_text(capsys.readouterr().out)
    ask = (
        f". {script}; spec=$(complete -p blossom); f=${{spec#*-F }}; f=${{f%% *}}; "
        "COMP_WORDS=(blossom ex); COMP_CWORD=1; "
        'COMP_LINE="blossom ex"; COMP_POINT=10; $f blossom ex blossom; echo "${COMPREPLY[@]}"'
    )
    done = subprocess.run(["bash", "-c", ask], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.split()) == {"export", "explain"}
