"""Proving a plan free of contact and in sight: as part of planning, and again from the files of a bundle."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from studio.workspace import Workspace

if TYPE_CHECKING:
    from planner.contact_certificate import ContactCertificate
    from planner.sight_certificate import SightCertificate

__all__ = [
    "CONTACT_FILE", "SIGHT_FILE", "contact_words", "matches_file", "prove_plan", "prove_sight",
    "record_contact",
]  # fmt: skip

CONTACT_FILE, SIGHT_FILE = "contact.json", "sight.json"


def prove_plan(ws: Workspace) -> ContactCertificate:
    """Prove every turn of the plan of a bundle, read from its files."""
    from planner.contact_certificate import certify_contact

    with ws.progress.stage("contact", f"proving {len(ws.plan.steps)} steps free of contact"):
        return certify_contact(ws.plan)


def prove_sight(ws: Workspace) -> SightCertificate:
    """Bound what is hidden during every turn of the plan of a bundle, read from its files."""
    from planner.sight_certificate import certify_sight

    with ws.progress.stage("sight", f"proving {len(ws.plan.steps)} steps in sight"):
        return certify_sight(ws.plan)


def record_contact(ws: Workspace, *, wanted: bool) -> None:
    """Write ``contact.json`` and ``sight.json`` for the plan of the bundle, or forget older ones."""
    from planner.contact_file import write_contact
    from planner.sight_file import write_sight

    for name in (CONTACT_FILE, SIGHT_FILE):
        ws.manifest.files.pop(name, None)
    if wanted:
        hashes = ws.hashes("net", "plan")
        write_contact(prove_plan(ws), ws.path(CONTACT_FILE), hashes)
        write_sight(prove_sight(ws), ws.path(SIGHT_FILE), hashes)
        ws.record("plan", CONTACT_FILE)
        ws.record("plan", SIGHT_FILE)


def contact_words(ws: Workspace) -> str:
    """What ``contact.json`` and ``sight.json`` say, in one line; empty if the bundle has none."""
    kept = [name for name in (CONTACT_FILE, SIGHT_FILE) if name in ws.manifest.files]
    return "; ".join(str(json.loads(ws.path(name).read_bytes())["summary"]) for name in kept)


def matches_file(ws: Workspace, proof: ContactCertificate, sight: SightCertificate) -> bool | None:
    """True if the bundle's files are byte for byte what the proofs write; None if it has none."""
    from planner.contact_file import contact_bytes
    from planner.sight_file import sight_bytes

    hashes = ws.hashes("net", "plan")
    made = {CONTACT_FILE: contact_bytes(proof, hashes), SIGHT_FILE: sight_bytes(sight, hashes)}
    kept = [name for name in made if name in ws.manifest.files]
    return all(ws.path(name).read_bytes() == made[name] for name in kept) if kept else None
