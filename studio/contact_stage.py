"""Proving a plan free of contact: as part of planning, and again from the files of a bundle."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from studio.workspace import Workspace

if TYPE_CHECKING:
    from planner.contact_certificate import ContactCertificate

__all__ = ["CONTACT_FILE", "contact_words", "matches_file", "prove_plan", "record_contact"]

CONTACT_FILE = "contact.json"


def prove_plan(ws: Workspace) -> ContactCertificate:
    """Prove every turn of the plan of a bundle, read from its files."""
    from planner.contact_certificate import certify_contact

    with ws.progress.stage("contact", f"proving {len(ws.plan.steps)} steps free of contact"):
        return certify_contact(ws.plan)


def record_contact(ws: Workspace, *, wanted: bool) -> None:
    """Write ``contact.json`` for the plan of the bundle, or forget the one of an older plan."""
    from planner.contact_file import write_contact

    ws.manifest.files.pop(CONTACT_FILE, None)
    if wanted:
        write_contact(prove_plan(ws), ws.path(CONTACT_FILE), ws.hashes("net", "plan"))
        ws.record("plan", CONTACT_FILE)


def contact_words(ws: Workspace) -> str:
    """What ``contact.json`` says, in one line; empty if the bundle has none."""
    if CONTACT_FILE not in ws.manifest.files:
        return ""
    return str(json.loads(ws.path(CONTACT_FILE).read_bytes())["summary"])


def matches_file(ws: Workspace, proof: ContactCertificate) -> bool | None:
    """True if the bundle's ``contact.json`` is byte for byte what ``proof`` writes; None if it has none."""
    from planner.contact_file import contact_bytes

    if CONTACT_FILE not in ws.manifest.files:
        return None
    return ws.path(CONTACT_FILE).read_bytes() == contact_bytes(proof, ws.hashes("net", "plan"))
