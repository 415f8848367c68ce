"""The report in a real browser, from disk: the pose is the planner's, nothing is fetched or goes wrong."""

from __future__ import annotations

import shutil
from math import floor

import numpy as np
import pytest

from planner.fold_plan import Fold
from planner.kinematics import folded_triangles
from tests.studio.report_page import small_report
from tests.studio.small_plan import small_plan

playwright = pytest.importorskip("playwright.sync_api")

FLAGS = [
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-background-networking",
]  # fmt: skip


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("no Chromium on this machine")
    file = tmp_path_factory.mktemp("report") / "report.html"
    file.write_bytes(small_report())
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=FLAGS)
        page = browser.new_page(viewport={"width": 1300, "height": 900}, offline=True)
        page.problems = []
        page.requests = []
        page.on("console", lambda m: page.problems.append(m.text) if m.type in ("error", "warning") else None)
        page.on("pageerror", lambda e: page.problems.append(str(e)))
        page.on("request", lambda r: page.requests.append(r.url))
        page.goto(file.as_uri())
        page.wait_for_selector("html[data-ready]", timeout=60_000)
        yield page
        browser.close()


def angles_at(plan, time):
    angles = np.zeros(len(plan.net.edges))
    for index, step in enumerate(plan.steps):
        if isinstance(step, Fold) and index < time:
            share = min(1.0, time - index)
            angles[step.crease] += share * (step.to_rad - angles[step.crease])
    return angles


@pytest.mark.parametrize("time", [0.0, 3.5, 4.0, 5.25, 8.75, 11.0])
def test_the_slider_moves_the_net_to_the_pose_of_the_plan(page, time):
    plan = small_plan()
    page.evaluate("t => window.blossom.seek(t)", time)
    shown = np.reshape(page.evaluate("window.blossom.corners()"), (-1, 3, 3))
    np.testing.assert_allclose(shown, folded_triangles(plan.net, angles_at(plan, time)), atol=1e-4)
    number = page.inner_text("#step-number")
    assert number.startswith(f"{min(floor(time) + (time % 1 > 0), 11)} ")


def test_links_between_table_net_and_view(page):
    page.click("[data-jump='1']")
    assert "face 3, crease 1" in page.inner_text("#picked-text")
    assert page.get_attribute("#net .picked", "data-face") == "3"
    page.click("tr[data-step='6']")
    assert page.inner_text("#step-text").startswith("fold crease 2 (mountain)")
    assert "now" in page.get_attribute("tr[data-step='6']", "class")
    page.click("#net [data-face='4']")
    assert "face 4" in page.inner_text("#picked-text")


def test_keys_step_and_play(page):
    page.evaluate("window.blossom.seek(2)")
    page.focus("#view")
    page.keyboard.press(".")
    assert page.inner_text("#step-number") == "3 / 11"
    page.keyboard.press("End")
    assert page.inner_text("#step-text") == "finished"
    page.keyboard.press(" ")
    page.wait_for_function("document.getElementById('play').getAttribute('aria-label') === 'pause'")
    page.keyboard.press(" ")
    page.wait_for_function("document.getElementById('play').getAttribute('aria-label') === 'play'")


def test_the_canvas_shows_something(page):
    page.evaluate("window.blossom.seek(6.5)")
    colours = page.evaluate(
        """() => { const c = document.getElementById('view'), g = c.getContext('webgl');
        if (!g) return null; const p = new Uint8Array(4 * c.width * c.height);
        g.readPixels(0, 0, c.width, c.height, g.RGBA, g.UNSIGNED_BYTE, p);
        const seen = new Set();
        for (let i = 0; i < p.length; i += 4) seen.add(p[i] << 16 | p[i + 1] << 8 | p[i + 2]);
        return seen.size; }"""
    )
    assert colours is None or colours > 10


def test_nothing_is_fetched_and_nothing_goes_wrong(page):
    assert [url for url in page.requests if not url.startswith(("file:", "data:"))] == []
    assert [
        text for text in page.problems if "GPU stall" not in text and "swiftshader" not in text.lower()
    ] == []
