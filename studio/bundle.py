"""Writing a bundle so that it is there whole or not at all."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain, islice
from pathlib import Path

from studio.bundle_check import open_manifest
from studio.errors import BundleError, OutputError
from studio.manifest import MANIFEST_NAME, STAGE_OF, UNHASHED, Manifest, read_manifest

__all__ = ["LATER_STAGES", "STAGES", "create_bundle", "edit_bundle"]

STAGES = ("net", "plan", "validate", "job", "report")
"""The stages that write files of the hashed set, in the order in which ``blossom make`` runs them."""

LATER_STAGES: dict[str, tuple[str, ...]] = {
    "net": ("plan", "validate", "job", "report"),
    "plan": ("validate", "job", "report"),
    "validate": ("report",),
    "job": ("report",),
    "report": (),
}
"""Which stages' files become stale when a stage runs again."""


def _own_file(name: str, manifest: Manifest) -> bool:
    return name in manifest.files or name == MANIFEST_NAME or name.startswith(UNHASHED)


def _check_target(target: Path, force: bool) -> None:
    """Refuse a target that exists, or that holds something which is not ours."""
    if not target.exists() and not target.is_symlink():
        return
    if not target.is_dir():
        raise OutputError(f"{target}: a file of that name is there already; name another folder with -o DIR")
    if target.resolve() in (Path.cwd(), *Path.cwd().parents):
        raise OutputError(
            f"{target}: the folder that you are in cannot be replaced; name another with -o DIR"
        )
    present = _files_below(target)
    first = next(present, None)
    if first is None:
        return
    if not force:
        raise OutputError(
            f"{target}: the folder exists and is not empty; name another with -o DIR, "
            "or add --force to replace the bundle in it"
        )
    try:
        manifest = read_manifest(target)
    except BundleError:
        manifest = Manifest(versions={}, files={name: {} for name in STAGE_OF})
    foreign = sorted(islice((n for n in chain([first], present) if not _own_file(n, manifest)), 4))
    if foreign:
        listed = ", ".join(foreign[:3]) + (" and more" if len(foreign) > 3 else "")
        raise OutputError(
            f"{target}: --force replaces a bundle only, but there is also {listed}; "
            "move that away or name another folder with -o DIR"
        )


def _files_below(target: Path) -> Iterator[str]:
    """Names of the files in a folder, however deep; only as many are looked for as are asked for."""

    def refuse(error: OSError) -> None:
        raise OutputError(
            f"{error.filename}: cannot be read ({error.strerror or error}); name another folder with -o DIR"
        ) from error

    for place, folders, files in os.walk(target, onerror=refuse):
        links = [name for name in folders if (Path(place) / name).is_symlink()]
        for name in (*files, *links):
            yield (Path(place) / name).relative_to(target).as_posix()


def _process_runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _remove_leftovers(target: Path) -> None:
    """Remove what runs that died half-way left beside ``target``."""
    for kind in ("partial", "old"):
        for path in target.parent.glob(f".{target.name}.{kind}-*"):
            pid = path.name.rpartition("-")[2]
            if pid.isdigit() and not _process_runs(int(pid)):
                shutil.rmtree(path, ignore_errors=True)


@contextmanager
def _workshop(target: Path) -> Iterator[Path]:
    """An empty folder beside ``target``, removed at the end if it is still there."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        _remove_leftovers(target)
        folder = target.parent / f".{target.name}.partial-{os.getpid()}"
        if folder.exists():
            shutil.rmtree(folder)
        folder.mkdir()
    except OSError as error:
        why = error.strerror or str(error)
        if isinstance(error, FileExistsError | NotADirectoryError):
            why = "a part of this path is a file"
        raise OutputError(
            f"{target}: cannot write there ({why}); name a folder that you may write to with -o DIR"
        ) from error
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def create_bundle(target: Path, *, force: bool = False) -> Iterator[Path]:
    """A folder to write a new bundle into; it becomes ``target`` only if the block ends well.

    Args:
        target: the folder of the bundle.
        force: replace a bundle that is there already.

    Raises:
        OutputError: if ``target`` exists (without ``force``), holds foreign files or cannot be written.
    """
    _check_target(target.absolute(), force)
    target = target.resolve()
    with _workshop(target) as folder:
        yield folder
        aside = target.parent / f".{target.name}.old-{os.getpid()}"
        try:
            if target.exists():
                target.rename(aside)
            folder.rename(target)
        except OSError as error:
            if aside.exists() and not target.exists():
                aside.rename(target)
            raise OutputError(f"{target}: cannot be written ({error.strerror or error})") from error
        shutil.rmtree(aside, ignore_errors=True)


@contextmanager
def edit_bundle(target: Path, stage: str) -> Iterator[tuple[Path, Manifest]]:
    """A copy of a checked bundle in which ``stage`` may run; what it wrote is put in place at the end.

    Files of later stages, which are stale now, are removed. The manifest is written last, so that a
    bundle that was half-updated is recognised by its hashes.

    Yields:
        The working folder and the manifest; the block has to call ``manifest.record`` for its files.

    Raises:
        BundleError: if the bundle is not whole.
        OutputError: if it cannot be written.
    """
    manifest = open_manifest(target)
    target = target.absolute()
    with _workshop(target) as folder:
        stale = LATER_STAGES[stage]
        listed = set(manifest.files)
        for name, entry in list(manifest.files.items()):
            if entry.get("stage") in stale:
                del manifest.files[name]
                continue
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(target / name, folder / name)
        for later in stale:
            manifest.parameters.pop(later, None)
        before = dict(manifest.files)
        yield folder, manifest
        try:
            for name in listed - set(manifest.files):
                (target / name).unlink(missing_ok=True)
            extra = [p.name for p in folder.iterdir() if p.is_file() and p.name.startswith(UNHASHED)]
            written = [name for name, entry in manifest.files.items() if entry != before.get(name)]
            for name in [*written, *extra]:
                (target / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).replace(target / name)
            (folder / MANIFEST_NAME).write_bytes(manifest.to_bytes())
            (folder / MANIFEST_NAME).replace(target / MANIFEST_NAME)
        except OSError as error:
            raise OutputError(f"{target}: cannot be written ({error.strerror or error})") from error
