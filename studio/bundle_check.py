"""Every stage reads a bundle through this check: files that were changed are named and refused."""

from __future__ import annotations

import re
from pathlib import Path

from studio.errors import BundleError
from studio.manifest import Manifest, file_sha256, read_manifest

__all__ = ["changed_files", "open_manifest"]

_PARTIAL = re.compile(r"^\..*\.partial-\d+$")


def changed_files(folder: Path, manifest: Manifest) -> dict[str, str]:
    """Files of the bundle that are not what the manifest says: name → what is wrong with it."""
    problems = {}
    for name, entry in sorted(manifest.files.items()):
        path = folder / name
        if not path.is_file():
            problems[name] = "missing"
        elif file_sha256(path) != entry["sha256"]:
            problems[name] = "changed"
    return problems


def open_manifest(folder: Path) -> Manifest:
    """Manifest of a bundle whose files all are what it says.

    Raises:
        BundleError: if ``folder`` is no bundle, is half-written, or a file was changed; the file is named.
    """
    if not folder.exists():
        raise BundleError(f"{folder}: no such bundle. Make one with: blossom make MESH -o {folder}")
    if not folder.is_dir():
        raise BundleError(f"{folder}: not a folder; expected the folder that blossom make wrote")
    if _PARTIAL.match(folder.resolve().name):
        raise BundleError(
            f"{folder}: this folder was left by a run that was stopped half-way; make the bundle again"
        )
    manifest = read_manifest(folder)
    problems = changed_files(folder, manifest)
    if problems:
        listed = ", ".join(f"{name} ({what})" for name, what in problems.items())
        raise BundleError(
            f"{folder}: not the files that were written here: {listed}. "
            f"Put the originals back, or make the bundle again with: blossom make MESH -o {folder} --force"
        )
    return manifest
