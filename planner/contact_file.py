"""``contact.json``: what was proven of every turn of a plan, for another run to prove again and compare."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import Any

from planner.atomic_file import write_atomic
from planner.contact_certificate import ENOUGH_MM, ContactCertificate, OpenPair, TurnProof

__all__ = ["contact_bytes", "write_contact"]

FORMAT, VERSION = "metal-blossom/contact", 1


def write_contact(
    certificate: ContactCertificate, path: str | os.PathLike[str], hashes: Mapping[str, str]
) -> None:
    """Write ``certificate`` to ``path``, whole or not at all.

    Args:
        certificate: from ``certify_contact``.
        path: usually ``contact.json`` in a bundle.
        hashes: sha256 of ``net`` and ``plan``, what the certificate is of.

    Raises:
        OSError: if the file cannot be written.
    """
    write_atomic(path, contact_bytes(certificate, hashes))


def contact_bytes(certificate: ContactCertificate, hashes: Mapping[str, str]) -> bytes:
    """The content of ``contact.json``: the same bytes for the same certificate and hashes.

    Intervals and planes are not written: whoever doubts them proves the plan again, which takes no longer
    than reading them would.
    """
    document = {
        "format": FORMAT,
        "version": VERSION,
        "net_sha256": hashes.get("net", ""),
        "plan_sha256": hashes.get("plan", ""),
        "summary": certificate.words(),
        "turns": len(certificate.turns),
        "free": certificate.free_turns,
        "proven": certificate.is_proven,
        "margin": _floor(certificate.margin_mm),
        "told_up_to": ENOUGH_MM,
        "error": float(f"{certificate.error_mm:.3g}"),
        "steps": [_turn(turn) for turn in certificate.turns],
    }
    return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()


def _turn(turn: TurnProof) -> dict[str, Any]:
    row: dict[str, Any] = {
        "step": turn.step,
        "crease": turn.crease,
        "from": _degrees(turn.from_rad),
        "to": _degrees(turn.to_rad),
        "margin": _floor(turn.margin_mm),
        "pairs": turn.pairs,
        "close_pairs": turn.close_pairs,
        "intervals": turn.intervals,
    }
    if turn.open_pairs:
        row["open"] = [_pair(pair) for pair in turn.open_pairs]
    return row


def _pair(pair: OpenPair) -> dict[str, Any]:
    return {
        "moving": pair.moving,
        "substrate" if pair.in_substrate else "still": pair.still,
        "kind": pair.kind,
        "from": _degrees(pair.from_rad),
        "to": _degrees(pair.to_rad),
    }


def _degrees(angle_rad: float) -> float:
    return round(math.degrees(angle_rad), 9) + 0.0


def _floor(length_mm: float) -> float:
    """A proven distance, rounded down to a nanometre."""
    return math.floor(length_mm * 1e6) / 1e6
