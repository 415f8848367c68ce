"""``validation.json``: the certificate on disk, angles in degrees."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from planner.atomic_file import write_atomic
from twin.errors import ValidationFileError
from twin.event_values import degrees, event_values, read_event
from twin.scatter_file import read_scatter, scatter_values
from twin.validation import Hinge, Validation

__all__ = ["read_validation", "read_validation_hashes", "validation_bytes", "write_validation"]

FORMAT, VERSION = "metal-blossom/validation", 1

_RENAMED = {"largest_sag_rad": "largest_sag"}


def validation_bytes(
    validation: Validation, hashes: Mapping[str, str], versions: Mapping[str, str] | None = None
) -> bytes:
    """The file's content; the same certificate, hashes and versions give the same bytes.

    Args:
        validation: the certificate.
        hashes: what it was made from, such as ``{"plan": "…"}``; written as ``plan_sha256`` and so on.
        versions: of the packages that the verdict depends on.

    Raises:
        ValidationFileError: if a figure is not finite.
    """
    data: dict[str, Any] = {"format": FORMAT, "version": VERSION}
    data |= {f"{name}_sha256": digest for name, digest in sorted(hashes.items())}
    data["versions"] = dict(sorted((versions or {}).items()))
    for item in fields(validation):
        data.setdefault(_RENAMED.get(item.name, item.name), getattr(validation, item.name))
    data["events"] = [event_values(e) for e in validation.events]
    data["noted"] = [event_values(e) for e in validation.noted]
    data["missed_by_dynamics"] = [event_values(e) for e in validation.missed_by_dynamics]
    data["hinges"] = [
        {"crease": h.crease, "goal": degrees(h.goal_rad), "wanted": degrees(h.wanted_rad),
         "reached": degrees(h.reached_rad)}
        for h in validation.hinges
    ]  # fmt: skip
    data["largest_sag"] = degrees(validation.largest_sag_rad)
    data["heating"] = {
        "model": validation.heating, "calibration": validation.calibration, "grade": validation.grade,
        "flags": list(validation.flags),
    }  # fmt: skip
    del data["calibration"], data["grade"], data["flags"]
    data["scatter"] = scatter_values(validation.scatter)
    try:
        return (json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
    except ValueError as error:
        raise ValidationFileError(f"the certificate holds a figure that is not finite: {error}") from error


def write_validation(
    validation: Validation,
    path: str | os.PathLike[str],
    hashes: Mapping[str, str] | None = None,
    versions: Mapping[str, str] | None = None,
) -> None:
    """Write the certificate, whole or not at all.

    Args:
        validation: the certificate.
        path: the file.
        hashes: what it was made from.
        versions: of the packages that the verdict depends on.

    Raises:
        ValidationFileError: if a figure is not finite.
        OSError: if the file cannot be written.
    """
    write_atomic(path, validation_bytes(validation, hashes or {}, versions))


def read_validation(path: str | os.PathLike[str]) -> Validation:
    """Read a certificate back.

    Raises:
        ValidationFileError: if the file is not a certificate of this version; the message names the place.
        OSError: if it cannot be read.
    """
    data = _parse(path)
    try:
        heating = data["heating"]
        known = {item.name for item in fields(Validation)}
        plain = {k: v for k, v in data.items() if k in known}
        return Validation(
            **plain
            | {
                "events": tuple(read_event(e) for e in data["events"]),
                "noted": tuple(read_event(e) for e in data["noted"]),
                "missed_by_dynamics": tuple(read_event(e) for e in data["missed_by_dynamics"]),
                "hinges": tuple(
                    Hinge(int(h["crease"]), *(math.radians(h[k]) for k in ("goal", "wanted", "reached")))
                    for h in data["hinges"]
                ),
                "largest_sag_rad": math.radians(data["largest_sag"]),
                "heating": heating["model"], "calibration": heating["calibration"], "grade": heating["grade"],
                "flags": tuple(heating["flags"]), "scatter": read_scatter(data["scatter"]),
                "warnings": tuple(data["warnings"]), "advice": tuple(data.get("advice", ())),
            }
        )  # fmt: skip
    except (KeyError, TypeError, ValueError) as error:
        raise ValidationFileError(
            f"{path}: not a complete certificate ({error!r}): validate again"
        ) from error


def read_validation_hashes(path: str | os.PathLike[str]) -> dict[str, str]:
    """What the certificate is bound to: name → sha256, such as ``plan``, ``job``, ``rig``, ``model``.

    Raises:
        ValidationFileError: if the file is not a certificate.
        OSError: if it cannot be read.
    """
    suffix = "_sha256"
    return {k.removesuffix(suffix): str(v) for k, v in _parse(path).items() if k.endswith(suffix)}


def _parse(path: str | os.PathLike[str]) -> dict[str, Any]:
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise ValidationFileError(f"{path}: not JSON ({error}): validate again") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise ValidationFileError(f'{path}: not a certificate: expected "format": "{FORMAT}"')
    if data.get("version") != VERSION:
        raise ValidationFileError(
            f"{path}: certificate version {data.get('version')!r}, expected {VERSION}: validate again"
        )
    return data
