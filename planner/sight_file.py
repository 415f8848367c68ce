"""``sight.json``: what was proven of the sight of every turn, for another run to prove again and compare."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import Any

from planner.atomic_file import write_atomic
from planner.sight_certificate import SightCertificate, TurnView

__all__ = ["sight_bytes", "write_sight"]

FORMAT, VERSION = "metal-blossom/sight", 1


def write_sight(
    certificate: SightCertificate, path: str | os.PathLike[str], hashes: Mapping[str, str]
) -> None:
    """Write ``certificate`` to ``path``, whole or not at all.

    Args:
        certificate: from ``certify_sight``.
        path: usually ``sight.json`` in a bundle.
        hashes: sha256 of ``net`` and ``plan``, what the certificate is of.

    Raises:
        OSError: if the file cannot be written.
    """
    write_atomic(path, sight_bytes(certificate, hashes))


def sight_bytes(certificate: SightCertificate, hashes: Mapping[str, str]) -> bytes:
    """The content of ``sight.json``: the same bytes for the same certificate and hashes."""
    document = {
        "format": FORMAT,
        "version": VERSION,
        "net_sha256": hashes.get("net", ""),
        "plan_sha256": hashes.get("plan", ""),
        "summary": certificate.words(),
        "hidden_max": certificate.hidden_max,
        "turns": len(certificate.turns),
        "proven": certificate.is_proven,
        "steps": [_turn(turn) for turn in certificate.turns],
    }
    return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()


def _turn(turn: TurnView) -> dict[str, Any]:
    row: dict[str, Any] = {
        "step": turn.step,
        "crease": turn.crease,
        "rotary": round(math.degrees(turn.rotary_rad), 9) + 0.0,
        "hidden": math.ceil(turn.hidden * 1e6) / 1e6,
        "intervals": turn.intervals,
        "proven": turn.proven,
    }
    if not turn.proven:
        row["from"] = round(math.degrees(turn.from_rad), 6) + 0.0
    return row
