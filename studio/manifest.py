"""The manifest of a bundle: what every file hashes to, and everything that led to it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

from studio.errors import BundleError

__all__ = [
    "MANIFEST_NAME", "STAGE_OF", "UNHASHED", "Manifest", "file_sha256", "package_versions", "read_manifest",
]  # fmt: skip

MANIFEST_NAME = "manifest.json"
FORMAT = "metal-blossom/manifest"
VERSION = 1

UNHASHED = ("timing.json", "journal-", "strip.csv")
"""Beginnings of the names of files that are no part of the hashed set: they hold wall-clock times, or what
a person wrote into them."""

_PACKAGES = ("metal-blossom", "numpy", "scipy", "mujoco-core", "shapely", "trimesh", "pymeshlab")


def file_sha256(path: Path) -> str:
    """Lower-case hexadecimal sha256 of the bytes of a file."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def package_versions() -> dict[str, str]:
    """Versions of Metal Blossom and of the packages that its results depend on."""
    versions = {}
    for name in _PACKAGES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            versions[name] = "not installed"
    return versions


@dataclass
class Manifest:
    """What ``manifest.json`` holds. Stages add to it; nothing in it depends on the clock or on paths.

    Attributes:
        input: name and sha256 of the input mesh.
        goal: name, notices and figures of the goal mesh.
        rig: name, sha256 and whole profile of the rig, empty before it is chosen.
        material: the same of the material.
        process: sha256 of the process table, empty before it is made.
        seed: seed of every random choice.
        parameters: per stage, every parameter that it ran with.
        versions: versions of the packages that the results depend on.
        files: file name → ``{"sha256", "bytes", "stage"}``.
    """

    input: dict[str, Any] = field(default_factory=dict)
    goal: dict[str, Any] = field(default_factory=dict)
    rig: dict[str, Any] = field(default_factory=dict)
    material: dict[str, Any] = field(default_factory=dict)
    process: dict[str, Any] = field(default_factory=dict)
    seed: int = 0
    parameters: dict[str, dict[str, Any]] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=package_versions)
    files: dict[str, dict[str, Any]] = field(default_factory=dict)

    def record(self, folder: Path, stage: str, names: list[str]) -> None:
        """Note size and sha256 of files that ``stage`` wrote into ``folder``."""
        for name in names:
            path = folder / name
            self.files[name] = {
                "sha256": file_sha256(path),
                "bytes": path.stat().st_size,
                "stage": stage,
            }

    def sha256_of(self, name: str) -> str:
        """Recorded sha256 of a file of the bundle.

        Raises:
            BundleError: if no stage has written that file yet.
        """
        if name not in self.files:
            raise BundleError(f"the bundle has no {name} yet; {_cure(name)}")
        return str(self.files[name]["sha256"])

    def to_bytes(self) -> bytes:
        """UTF-8 JSON with sorted keys: the same values give the same bytes. It ends in its own seal."""
        document = {
            "format": FORMAT,
            "version": VERSION,
            "input": self.input,
            "goal": self.goal,
            "rig": self.rig,
            "material": self.material,
            "process": self.process,
            "seed": self.seed,
            "parameters": self.parameters,
            "versions": self.versions,
            "files": self.files,
        }
        return _json_bytes(document | {"seal": _seal(document)})


def _json_bytes(document: dict[str, Any]) -> bytes:
    text = json.dumps(document, indent=1, sort_keys=True, ensure_ascii=False, allow_nan=False)
    return (text + "\n").encode()


def _seal(document: dict[str, Any]) -> str:
    """Sha256 of the manifest without its seal: no other file tells whether the manifest was changed."""
    return hashlib.sha256(_json_bytes({k: v for k, v in document.items() if k != "seal"})).hexdigest()


STAGE_OF = {
    "rig.toml": "net", "material.toml": "net", "goal.ply": "net", "net.fold": "net",
    "plan.json": "plan", "sheet.svg": "plan", "sheet.dxf": "plan", "contact.json": "plan",
    "sight.json": "plan", "model.xml": "validate", "model.json": "validate", "validation.json": "validate",
    "checkpoints.npz": "validate", "black-box.npz": "validate", "job.gcode": "job", "job.json": "job",
    "report.html": "report", "motion.glb": "report", "strip.svg": "testgrid",
}  # fmt: skip
"""The stage that writes each file of a bundle."""


def _cure(name: str) -> str:
    stage = STAGE_OF.get(name)
    if stage in (None, "net"):
        return "make the bundle with: blossom net MESH -o DIR"
    return f"make it with: blossom {stage} DIR"


def read_manifest(folder: Path) -> Manifest:
    """Read ``manifest.json`` of a bundle.

    Raises:
        BundleError: if it is missing or does not follow its format; the message says what to do.
    """
    path = folder / MANIFEST_NAME
    try:
        document = json.loads(path.read_bytes())
    except FileNotFoundError:
        raise BundleError(
            f"{folder} is no complete bundle: it has no {MANIFEST_NAME}. "
            "Was a run stopped half-way? Make it again with: blossom make MESH -o DIR --force"
        ) from None
    except (ValueError, RecursionError) as error:
        raise BundleError(
            f"{path}: not valid JSON ({error}). The bundle was damaged; make it again"
        ) from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise BundleError(f'{path}: expected "format": "{FORMAT}"; this is no manifest of a bundle')
    if document.get("version") != VERSION:
        raise BundleError(
            f"{path}: version {document.get('version')!r}, but this program reads version {VERSION}; "
            "make the bundle again"
        )
    types = {
        "input": dict, "goal": dict, "rig": dict, "material": dict, "process": dict, "seed": int,
        "parameters": dict, "versions": dict, "files": dict,
    }  # fmt: skip
    for name, kind in types.items():
        if not isinstance(document.get(name), kind):
            raise BundleError(f"{path}: $.{name}: expected {kind.__name__}; the bundle was damaged")
    for name, entry in document["files"].items():
        if not isinstance(entry, dict) or not isinstance(entry.get("sha256"), str):
            raise BundleError(
                f"{path}: $.files.{name}: expected an object with sha256; the bundle was damaged"
            )
        if Path(name).is_absolute() or ".." in Path(name).parts:
            raise BundleError(f"{path}: $.files.{name}: a file of a bundle lies inside its folder")
    try:
        whole = document.get("seal") == _seal(document)
    except ValueError:  # a number that JSON does not have, or half of a surrogate pair
        whole = False
    if not whole:
        raise BundleError(
            f"{path} was changed after it was written: put the original back, or make the bundle again"
        )
    return Manifest(**{name: document[name] for name in types})
