"""The guide of a bundle as a file: HTML, or PDF printed by a browser that is installed."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

from planner.atomic_file import write_atomic
from studio.bundle_check import open_manifest
from studio.bundle_summary import bundle_summary, step_settings
from studio.errors import StudioError, UsageError
from studio.guide import GuideData, guide_html
from studio.guide_pictures import pictures, stretches
from studio.png import png
from studio.progress import Progress
from studio.workspace import Workspace

__all__ = ["BROWSERS", "PrintError", "write_guide"]

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
"""Programs that print a page to PDF, in the order in which they are looked for."""

_PRINT_S = 120.0


class PrintError(StudioError, RuntimeError):
    """No PDF can be made on this computer (exit code 2)."""


def write_guide(bundle: Path, file: Path, progress: Progress) -> str:
    """Write the guide of a bundle, whole or not at all; returns what was written, in words.

    Args:
        bundle: folder with plan and job.
        file: ending in ``.html`` or ``.pdf``.
        progress: where to tell how far it is.

    Raises:
        UsageError: if the ending is another one.
        BundleError: if the bundle has no job yet, or was changed.
        RenderError: if pictures cannot be drawn here.
        PrintError: if there is no browser for a PDF, or it fails.
        OSError: if the file cannot be written.
    """
    kind = file.suffix.lower()
    if kind not in (".html", ".pdf"):
        raise UsageError(f"{file}: a guide ends in .html or .pdf")
    browser = _browser() if kind == ".pdf" else ""
    ws = Workspace(bundle, open_manifest(bundle), progress)
    ws.manifest.sha256_of("job.json")
    settings = step_settings(ws)
    chosen = stretches(ws.plan, settings)
    with progress.stage("guide", f"drawing {len(chosen)} pictures"):
        drawn = [png(image) for image in pictures(ws, chosen)]
    data = GuideData(
        ws.plan, ws.rig, ws.material, ws.job, bundle_summary(ws), bundle.as_posix(), chosen, drawn
    )
    page = guide_html(data)
    if kind == ".html":
        write_atomic(file, page)
    else:
        with progress.stage("guide", "printing"):
            write_atomic(file, _printed(browser, page))
    return f"{file}: {len(chosen)} pictures, {file.stat().st_size / 1000:.0f} kB"


def _browser() -> str:
    found = next((path for name in BROWSERS if (path := shutil.which(name))), "")
    if not found:
        raise PrintError(
            "a PDF is printed by Chromium or Chrome, and none was found: install one, or write FILE.html and "
            "print that"
        )
    return found


def _printed(browser: str, page: bytes) -> bytes:
    """The page as PDF."""
    with tempfile.TemporaryDirectory(prefix="blossom-guide-") as folder:
        source, made = Path(folder) / "guide.html", Path(folder) / "guide.pdf"
        source.write_bytes(page)
        command = [
            browser, "--headless=new", "--disable-gpu", "--no-sandbox", f"--user-data-dir={folder}/profile",
            "--no-pdf-header-footer", f"--print-to-pdf={made}", source.as_uri(),
        ]  # fmt: skip
        try:
            done = subprocess.run(command, capture_output=True, timeout=_PRINT_S, check=False)  # noqa: S603  no shell
        except subprocess.TimeoutExpired:
            raise PrintError(
                f"{browser} did not print within {_PRINT_S:g} s; write FILE.html instead"
            ) from None
        if not made.is_file():
            words = done.stderr.decode("utf-8", "replace").strip().splitlines()
            raise PrintError(f"{browser} printed nothing: {words[-1] if words else 'no words'}")
        return made.read_bytes()
