"""The report in a real browser, from disk: the pose is the planner's, nothing is fetched or goes wrong."""

from __future__ import annotations

from math import floor

import numpy as np
import pytest

from planner.fold_plan import Fold
from planner.kinematics import folded_triangles
from tests.studio.browser import open_browser, open_page, problems_of
from tests.studio.report_page import small_report
from tests.studio.small_plan import small_plan
from twin.shape_error import shape_errors


@pytest.fixture(scope="module")
def browser():
    with open_browser() as browser:
        yield browser


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    file = tmp_path_factory.mktemp("report") / "report.html"
    file.write_bytes(small_report())
    return file


@pytest.fixture(scope="module")
def page(browser, file):
    return open_page(browser, file)


@pytest.fixture(autouse=True)
def nothing_is_picked(page):
    page.keyboard.press("Escape")


def angles_at(plan, time):
    angles = np.zeros(len(plan.net.edges))
    for index, step in enumerate(plan.steps):
        if isinstance(step, Fold) and index < time:
            share = min(1.0, time - index)
            angles[step.crease] += share * (step.to_rad - angles[step.crease])
    return angles


def seek(page, time):
    page.evaluate("t => window.blossom.seek(t)", time)


@pytest.mark.parametrize("time", [0.0, 3.5, 4.0, 5.25, 8.75, 11.0])
def test_the_slider_moves_the_net_to_the_pose_of_the_plan(page, time):
    plan = small_plan()
    page.locator("#time").fill(f"{time:g}")
    shown = np.reshape(page.evaluate("window.blossom.corners()"), (-1, 3, 3))
    np.testing.assert_allclose(shown, folded_triangles(plan.net, angles_at(plan, time)), atol=1e-4)
    number = page.inner_text("#step-number")
    assert number.startswith(f"{min(floor(time) + (time % 1 > 0), 11)} ")


@pytest.mark.parametrize(
    ("time", "turned", "left", "falling", "beam", "tabs"),
    [(0.0, 0.0, 9, False, False, True), (0.5, 0.0, 9, False, True, True),
     (1.5, 0.0, 8, True, False, True), (3.5, np.pi, 8, False, True, True),
     (10.5, 0.0, 8, False, True, False)],
)  # fmt: skip
def test_the_machine_does_what_the_step_says(page, time, turned, left, falling, beam, tabs):
    seek(page, time)
    shown = page.evaluate("window.blossom.shown()")
    assert page.evaluate("window.blossom.rotary()") == pytest.approx(turned)
    assert (shown["flat"], shown["falling"], shown["beam"], shown["tabs"]) == (left, falling, beam, tabs)


def test_the_sheet_is_gone_when_the_part_is_free(page):
    seek(page, 11)
    assert not page.evaluate("window.blossom.shown()")["sheet"]


def test_the_clock_follows_the_machine_time_of_the_steps(page):
    seek(page, 3.5)
    assert page.inner_text("#clock-text") == "24 s of 42 s"
    assert page.inner_text("#rotary-text") == "rotary 180°, bottom side up"


def test_a_face_picked_in_the_net_is_picked_in_the_view(page):
    page.click("#net [data-face='4']")
    assert page.evaluate("window.blossom.picked()") == {"face": 4, "crease": -1}
    assert page.inner_text("#picked-text").startswith("face 4, turned by crease 2: mountain, now ")
    page.click("#net [data-face='4']")
    assert page.evaluate("window.blossom.picked()") == {"face": -1, "crease": -1}
    assert page.locator("#net .picked").count() == 0


@pytest.mark.parametrize(("face", "time"), [(0, 0.0), (2, 0.0), (5, 0.0), (4, 6.2)])
def test_a_face_picked_in_the_view_is_picked_in_the_net(page, face, time):
    seek(page, time)
    page.locator("#view").scroll_into_view_if_needed()
    place = page.evaluate("f => window.blossom.place(f)", face)
    page.locator("#view").click(position=place)
    assert page.evaluate("window.blossom.picked()")["face"] == face
    assert page.get_attribute("#net polygon.picked", "data-face") == str(face)


def test_a_crease_picked_in_the_view_is_picked_in_net_and_table(page):
    seek(page, 0)
    page.locator("#view").click(position=page.evaluate("window.blossom.placeOfCrease(1)"))
    assert page.evaluate("window.blossom.picked()") == {"face": 3, "crease": 1}
    assert page.get_attribute("#net line.picked", "data-crease") == "1"
    marked = page.eval_on_selector_all("tr.of-picked", "rows => rows.map(r => r.dataset.step)")
    assert marked == ["5", "8"]
    assert "would touch faces 2, 4" in page.inner_text("#picked-blocked")
    page.click("#jump")
    assert page.inner_text("#step-text").startswith("fold crease 1 (mountain) from -64.9°")


def test_a_blocked_crease_leads_to_its_step(page):
    seek(page, 0)
    page.click("td [data-jump='1']")
    assert page.inner_text("#picked-text").startswith("crease 1, turns face 3")
    assert page.get_attribute("#net polygon.picked", "data-face") == "3"
    assert page.inner_text("#step-number") == "9 / 11"
    assert "now" in page.get_attribute("tr[data-step='8']", "class")


def test_a_row_of_the_table_leads_to_its_step(page):
    page.click("tr[data-step='6']")
    assert page.inner_text("#step-text").startswith("fold crease 2 (mountain)")
    assert "now" in page.get_attribute("tr[data-step='6']", "class")
    assert page.evaluate("window.blossom.picked()") == {"face": 4, "crease": 2}


@pytest.mark.parametrize("layer", ["cut", "mountain", "clip", "tab", "frame"])
def test_layers_of_the_net_can_be_switched(page, layer):
    shown = f"getComputedStyle(document.querySelector('#net .{layer}')).display"
    assert page.evaluate(shown) != "none"
    page.uncheck(f"[data-layer={layer}]")
    assert page.evaluate(shown) == "none"
    page.check(f"[data-layer={layer}]")
    assert page.evaluate(shown) != "none"


def test_order_colours_run_along_the_folds(page):
    page.select_option("#colour", "order")
    faces = "shapes => Object.fromEntries(shapes.map(s => [s.dataset.face, s.style.fill]))"
    fills = page.eval_on_selector_all("#net [data-face]", faces)
    assert fills["0"] == fills["1"] == ""
    order = [fills[face] for face in "2345"]
    assert len(set(order)) == 4

    def brightness(text):
        return sum(float(part) for part in text.removeprefix("rgb(").rstrip(")").split(","))

    assert [brightness(text) for text in order] == sorted(brightness(text) for text in order)
    assert page.inner_text("#scale-low") == "folded first"
    page.select_option("#colour", "heat")


def test_the_goal_is_laid_over_the_reached_shape_with_its_error(page):
    plan = small_plan()
    rms, largest = shape_errors(plan.net, folded_triangles(plan.net, plan.final_angles)[None])
    page.click("#compare")
    assert page.evaluate("window.blossom.shown()")["goal"]
    assert page.input_value("#colour") == "error"
    told = page.evaluate("window.blossom.errors()")
    assert told["rms"] == pytest.approx(rms[0], abs=1e-4)
    assert told["largest"] == pytest.approx(largest[0], abs=1e-4)
    assert page.inner_text("#error-text") == (
        f"reached shape against goal: {rms[0]:.2f} mm rms, {largest[0]:.2f} mm at most"
    )
    assert page.inner_text("#scale-high") == f"{largest[0]:.2f} mm"
    page.uncheck("#show-goal")
    page.select_option("#colour", "heat")


def test_keys_step_play_turn_and_walk(page):
    seek(page, 2)
    page.focus("#view")
    page.keyboard.press(".")
    assert page.inner_text("#step-number") == "3 / 11"
    page.keyboard.press(",")
    assert page.inner_text("#step-number") == "2 / 11"
    page.keyboard.press("PageDown")
    assert page.inner_text("#step-text") == "finished"
    page.keyboard.press("Home")
    assert page.inner_text("#step-text") == "flat sheet"
    before = page.evaluate("window.blossom.place(2)")
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("window.blossom.place(2)") != before
    page.keyboard.press("0")
    assert page.evaluate("window.blossom.place(2)") == pytest.approx(before)
    page.keyboard.press(" ")
    page.wait_for_selector("#play[aria-label=pause]")
    page.keyboard.press(" ")
    page.wait_for_selector("#play[aria-label=play]")
    page.focus("#time")
    page.keyboard.press("End")
    page.keyboard.press("ArrowLeft")
    assert page.inner_text("#step-number") == "10 / 11"
    assert page.get_attribute("#time", "aria-valuetext") == "step 10: rotate to 0° (top side up)"
    page.focus("#net")
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    assert page.evaluate("window.blossom.picked()")["face"] == 2
    page.keyboard.press("Enter")
    assert page.inner_text("#step-text").startswith("fold crease 0")
    page.focus("#steps")
    page.keyboard.press("ArrowDown")
    assert page.inner_text("#step-text").startswith("wait")


def test_everything_that_can_be_used_can_be_reached_by_tab(page):
    page.evaluate("document.activeElement.blur()")
    reached = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id || document.activeElement.dataset.layer || ''"))
    wanted = {
        "view",
        "play",
        "next",
        "time",
        "speed",
        "colour",
        "show-goal",
        "compare",
        "net",
        "steps",
        "cut",
    }
    assert wanted <= reached


def test_the_canvas_shows_something(page):
    seek(page, 6.5)
    colours = page.evaluate(
        """() => { const c = document.getElementById('view'), g = c.getContext('webgl2');
        const p = new Uint8Array(4 * c.width * c.height);
        g.readPixels(0, 0, c.width, c.height, g.RGBA, g.UNSIGNED_BYTE, p);
        const seen = new Set();
        for (let i = 0; i < p.length; i += 4) seen.add(p[i] << 16 | p[i + 1] << 8 | p[i + 2]);
        return seen.size; }"""
    )
    assert colours > 10


def test_nothing_is_fetched_and_nothing_goes_wrong(page):
    assert [url for url in page.requests if not url.startswith(("file:", "data:"))] == []
    assert problems_of(page) == []


def test_a_link_to_a_moment_opens_there(browser, file):
    page = browser.new_page(offline=True)
    page.goto(f"{file.as_uri()}#t=4.5")
    page.wait_for_selector("html[data-ready]", timeout=60_000)
    assert page.inner_text("#step-text").startswith("wait 2 s")
    page.close()


def test_with_reduced_motion_only_whole_steps_are_shown(browser, file):
    page = open_page(browser, file, reduced_motion="reduce")
    seek(page, 0)
    page.evaluate(
        """() => { window.seen = []; const text = document.getElementById('step-number');
        new MutationObserver(() => window.seen.push(Number(document.getElementById('time').value)))
          .observe(text, {childList: true}); }"""
    )
    page.select_option("#speed", "30")
    page.click("#play")
    page.wait_for_selector("#play[aria-label=play]")
    seen = page.evaluate("window.seen")
    assert seen[-1] == 11
    assert all(time == int(time) for time in seen)
    assert page.evaluate("getComputedStyle(document.querySelector('#net .face')).transitionDuration") == "0s"
    page.close()


def test_without_webgl_the_rest_of_the_page_works(browser, file):
    page = browser.new_page(offline=True)
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.goto(file.as_uri())
    page.wait_for_selector("html[data-ready]", timeout=60_000)
    assert "no WebGL" in page.inner_text("#view-note")
    page.click("td [data-jump='1']")
    assert page.inner_text("#step-number") == "9 / 11"
    assert page.locator("#net polygon.picked").count() == 1
    page.close()


CONTRAST = """() => {
  const parse = (text) => {
    const n = text.match(/[\\d.]+/g).map(Number);
    return [...n.slice(0, 3), n[3] ?? 1];
  };
  const linear = (v) => (v / 255 <= 0.03928 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
  const light = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  const poor = [];
  for (const node of document.querySelectorAll("main *")) {
    const own = Array.from(node.childNodes).some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own || !node.checkVisibility() || node.closest("svg")) continue;
    let back = null;
    for (let at = node; at && !back; at = at.parentElement) {
      const c = parse(getComputedStyle(at).backgroundColor);
      if (c[3] > 0) back = c;
    }
    const [a, b] = [light(parse(getComputedStyle(node).color)), light(back ?? [255, 255, 255])];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) poor.push([node.tagName, node.className, node.textContent.trim().slice(0, 30), ratio]);
  }
  return poor;
}"""
"""Texts that stand out by less than 4.5 to 1 (WCAG 2.1, AA), with their ratios."""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_text_stands_out_from_its_ground(browser, file, scheme):
    page = open_page(browser, file, color_scheme=scheme)
    page.click("td [data-jump='1']")
    page.evaluate("document.querySelector('details').open = true")
    assert page.evaluate(CONTRAST) == []
    page.close()


@pytest.mark.parametrize("width", [390, 800])
def test_a_narrow_window_needs_no_scrolling_sideways(browser, file, width):
    page = open_page(browser, file, viewport={"width": width, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("#view").bounding_box()["width"] <= width
    page.close()


def test_the_printed_page_has_all_steps_and_no_controls(browser, file):
    page = open_page(browser, file, color_scheme="dark")
    page.emulate_media(media="print", color_scheme="dark")
    assert not page.locator("#play").is_visible()
    assert not page.locator("[data-layer=cut]").is_visible()
    assert page.locator("#view").is_visible()
    assert page.locator("#net").is_visible()
    table = page.evaluate(
        "(() => { const b = document.getElementById('steps'); return [b.scrollHeight, b.clientHeight]; })()"
    )
    assert table[0] == table[1]
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert page.evaluate(CONTRAST) == []
    printed = page.pdf(format="A4")
    assert printed.startswith(b"%PDF")
    assert printed.count(b"/Type /Page\n") >= 2
    page.close()


def test_pictures_of_three_moments_are_kept(page, artefacts):
    """For people to look at: where ``--artefacts`` says, else in a folder of the test run."""
    sizes = set()
    for name, time in (("begin", 0.5), ("middle", 5.3), ("end", 11.0)):
        seek(page, time)
        picture = artefacts / f"report-{name}.png"
        page.screenshot(path=picture, full_page=True)
        sizes.add(picture.stat().st_size)
    assert len(sizes) == 3
