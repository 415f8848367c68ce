"""Every error becomes one message and one exit code."""

from __future__ import annotations

import pytest

from planner.errors import FormatError, MeshError, NetError, PlanError
from rigs.errors import JobError, MachineError, ProfileError, UnknownNameError
from studio.errors import BundleError, OutputError, UsageError
from studio.exit_codes import exit_code_of
from studio.messages import error_text
from twin.errors import HeatingError, ModelError, SimulationError, ValidationFileError

ERRORS = [
    (MeshError("a.obj: no faces"), 2),
    (FormatError("net.fold: no faces"), 2),
    (NetError("not formable from one sheet", (3, 4, 5, 6, 7, 8, 9, 10, 11)), 1),
    (PlanError("the sheet does not fit"), 1),
    (ProfileError("my.toml: $.laser.max_w: expected a number"), 2),
    (UnknownNameError("rig", "gbrl-4axis", ["grbl-4axis", "galvo-like"]), 2),
    (JobError("crease 4: too far out"), 1),
    (MachineError("ALARM:1", block=3, step=2), 3),
    (ModelError("too deep"), 2),
    (HeatingError("crease 3: would melt"), 1),
    (SimulationError("no memory for the model"), 1),
    (ValidationFileError("not a certificate"), 2),
    (BundleError("net.fold (changed)"), 2),
    (OutputError("out: exists"), 2),
    (UsageError("--tilt 99: too much"), 2),
    (FileNotFoundError(2, "No such file or directory", "bunny.obj"), 2),
    (PermissionError(13, "Permission denied", "/root/x"), 2),
    (IsADirectoryError(21, "Is a directory", "models"), 2),
    (MemoryError(), 2),
    (KeyboardInterrupt(), 130),
    (ZeroDivisionError("division by zero"), 70),
    (KeyError(), 70),
]


@pytest.mark.parametrize(("error", "code"), ERRORS, ids=lambda value: type(value).__name__)
def test_exit_code(error, code):
    assert exit_code_of(error) == code


def test_error_texts(snapshot):
    assert "\n".join(error_text(error) for error, _ in ERRORS) == snapshot


def test_no_message_has_more_than_one_paragraph_or_none():
    for error, _ in ERRORS:
        text = error_text(error)
        assert text.strip()
        assert "\n" not in text
        assert "Traceback" not in text
