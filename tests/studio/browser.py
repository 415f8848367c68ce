"""A Chromium for tests and benchmarks of the page."""

from __future__ import annotations

import contextlib
import os
import shutil

import pytest

FLAGS = [
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-background-networking",
]  # fmt: skip
NAMES = ("chromium", "chromium-browser", "google-chrome")


@contextlib.contextmanager
def open_browser():
    """A browser of Playwright; skips without a Chromium, but fails where ``CI`` is set."""
    playwright = pytest.importorskip("playwright.sync_api")
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        told = f"no Chromium on this machine: install one of {', '.join(NAMES)}"
        if os.environ.get("CI"):
            pytest.fail(told)
        pytest.skip(told)
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()


def open_page(browser, file, **context):
    """A page from disk without a network; ``problems`` and ``requests`` collect what it says and asks for."""
    page = browser.new_page(**{"viewport": {"width": 1300, "height": 900}, "offline": True} | context)
    page.problems, page.requests = [], []
    page.on("console", lambda m: page.problems.append(m.text) if m.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: page.problems.append(str(error)))
    page.on("request", lambda request: page.requests.append(request.url))
    page.goto(file.as_uri())
    page.wait_for_selector("html[data-ready]", timeout=60_000)
    return page


def problems_of(page):
    """What the page complained about, without the notes of the software renderer on itself."""
    own = ("GPU stall", "swiftshader", "GroupMarkerNotSet")
    return [text for text in page.problems if not any(word.lower() in text.lower() for word in own)]
