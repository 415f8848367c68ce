"""``blossom emulate`` as a user runs it: what it refuses, and a machine that answers through a bad cable."""

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from studio.cli import main

BLOSSOM = Path(sys.executable).with_name("blossom")


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("--port 80", "1024"), ("--time-scale -1", "0 or more"), ("--time-scale nan", "0 or more"),
        ("--baud -5", "0 or more"), ("nosuch", "unknown rig 'nosuch'"), ("--fault bad@x", "fault 'bad@x'"),
        ("--cable flip@out3", "flip:4@in17"), ("--cable nowhere", "nowhere"),
    ],
)  # fmt: skip
def test_wrong_input_is_answered_in_words_before_anything_runs(line, named, capsys):
    assert main(["emulate", *line.split()]) == 2
    assert named in capsys.readouterr().err


def test_it_answers_through_its_cable_and_ends_with_ctrl_c():
    done = subprocess.Popen(
        [BLOSSOM, "emulate", "--cable", "double@out0"], text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    try:
        line = done.stdout.readline()
        assert line.startswith("EMULATED machine at socket://127.0.0.1:")
        host, _, port = line.split()[3].removeprefix("socket://").partition(":")
        with socket.create_connection((host, int(port)), timeout=30) as near:
            near.settimeout(30)
            near.sendall(b"?")
            heard = b""
            while heard.count(b"<") < 2:  # the first byte came twice, and so does the answer
                heard += near.recv(4096)
        done.send_signal(signal.SIGINT)
        out, err = done.communicate(timeout=60)
    finally:
        done.kill()
    assert done.returncode == 0
    assert (out, err) == ("ended\n", "")
