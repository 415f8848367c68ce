"""``blossom certify``: prove a plan free of contact and in sight, once more and from its bundle alone."""

from __future__ import annotations

import json as json_text

from studio.exit_codes import DONE, NO
from studio.flags import Bundle, Json, Quiet
from studio.progress import Progress

__all__ = ["certify"]


def certify(bundle: Bundle, /, *, json: Json = False, quiet: Quiet = False) -> int:
    """Prove that nothing touches while a plan is folded, and that every crease stays in sight of the beam.

    Compares with contact.json and sight.json that plan or make left with --certify. Changes nothing in the
    bundle.

    Examples:
        blossom certify out/bunny
    """
    from studio.bundle_check import open_manifest
    from studio.contact_stage import matches_file, prove_plan, prove_sight
    from studio.workspace import Workspace

    ws = Workspace(bundle, open_manifest(bundle), Progress(quiet=quiet or json))
    proof = prove_plan(ws)
    sight = prove_sight(ws)
    same = matches_file(ws, proof, sight)
    if json:
        values = {
            "format": "metal-blossom/certify", "version": 1, "proven": proof.is_proven and sight.is_proven,
            "turns": len(proof.turns), "free": proof.free_turns, "margin_mm": proof.margin_mm,
            "summary": proof.words(), "sight": sight.words(), "sight_proven": sight.is_proven,
            "matches_file": same,
        }  # fmt: skip
        print(json_text.dumps(values, ensure_ascii=False, allow_nan=False))  # noqa: T201  command output
    else:
        print(proof.words())  # noqa: T201  command output
        print(sight.words())  # noqa: T201  command output
        if same is not None:
            told = "the same as" if same else "not what is in"
            print(f"{told} contact.json and sight.json")  # noqa: T201  command output
    return DONE if proof.is_proven and sight.is_proven and same is not False else NO
