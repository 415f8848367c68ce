"""The report is one well-formed page that needs no network and says what the plan says."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
import pytest

from studio.report import report_html
from studio.report_data import viewer_values
from studio.report_net_svg import net_svg
from tests.studio.report_page import small_manifest, small_report, small_settings, small_summary
from tests.studio.small_plan import small_plan

VOID = {"meta", "link", "input", "br", "img"}


class Page(HTMLParser):
    """Collects tags, attributes and text, and checks that every tag is closed."""

    def __init__(self, source):
        super().__init__(convert_charrefs=True)
        self.open, self.attributes, self.text = [], [], ""
        self.feed(source)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.attributes += [(tag, name, value) for name, value in attrs]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("script", "style"):
            self.text += data


@pytest.fixture(scope="module")
def source():
    return small_report().decode()


def test_the_page_is_well_formed_and_loads_nothing(source):
    page = Page(source)
    for _tag, name, value in page.attributes:
        if name in ("src", "href", "action", "data", "poster", "srcset"):
            assert value == "data:,"
    assert "{{" not in source
    links = set(re.findall(r"https?://[^\s\"'`<>]+", source))
    assert links <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xhtml"}  # names, not addresses
    assert "@import" not in source
    assert "url(" not in source
    assert "default-src 'none'" in source


def test_ids_are_there_once_and_labels_point_to_them(source, repository):
    page = Page(source)
    ids = [value for _, name, value in page.attributes if name == "id"]
    assert len(ids) == len(set(ids))
    for _, name, value in page.attributes:
        if name == "aria-labelledby":
            assert value in ids
    viewer = "".join(file.read_text() for file in (repository / "studio" / "viewer" / "src").glob("*.js"))
    wanted = set(re.findall(r'\bel\("([\w-]+)"\)', viewer))
    assert wanted
    assert wanted <= set(ids)


def test_the_page_says_what_people_ask_for(source):
    text = Page(source).text
    for words in (
        "pyramid", "90.0", "1.25", "mm rms", "20 min 34 s", "512", "validated: pass", "grbl-4axis",
        "the moving part would touch faces 2, 4", "rotate to 180° (bottom side up)", "cd" * 32, "ab" * 32,
        "metal-blossom", "scaled from 1 to 60 mm", "seed", "75",
        "% of 40 draws pass", "grade C", "not calibrated",
        "blossom net pyramid.obj --rig grbl-4axis --material 304",
    ):  # fmt: skip
        assert words in text, words
    assert text.count("fold crease") == 5


def test_names_cannot_break_out_of_the_page():
    evil = '</script><script>alert("x")</script>&amp;'
    page = Page(small_report(mesh=evil, notices=(evil,)).decode())
    assert sum(tag == "script" for tag, name, _ in page.attributes if name == "type") == 1
    assert evil in page.text


@pytest.mark.parametrize(
    ("verdict", "words", "kind"),
    [("pass", "✓ validated: pass", "pass"), ("contact", "✗ verdict: contact", "no"),
     ("not validated", "not validated yet", "open")],
)  # fmt: skip
def test_the_verdict_is_told_by_words_as_well_as_colour(verdict, words, kind):
    source = small_report(verdict=verdict).decode()
    assert f'<span class="verdict {kind}">{words}</span>' in source


def test_a_page_without_validation_and_settings():
    Page(report_html(small_plan(), small_summary(passes=None, blocked=()), small_manifest()).decode())


def test_same_arguments_same_bytes():
    assert small_report() == small_report()


def test_embedded_values_are_those_of_the_plan(source):
    plan = small_plan()
    found = re.search(r'<script type="application/json" id="plan-data">(.*?)</script>', source, re.DOTALL)
    assert found
    values = json.loads(found.group(1))
    assert values == json.loads(json.dumps(viewer_values(plan, small_settings())))
    np.testing.assert_allclose(np.reshape(values["vertices"], (-1, 2)), plan.net.vertices, atol=1e-5)
    assert [s["op"] for s in values["steps"]] == [
        "cut", "clip", "rotate", "fold", "wait", "fold", "fold", "fold", "fold", "rotate", "release",
    ]  # fmt: skip
    assert [(s["from"], s["to"]) for s in values["steps"] if s["op"] == "fold" and s["crease"] == 1] == [
        (0, pytest.approx(-64.90279)), (pytest.approx(-64.90279), pytest.approx(-77.88335)),
    ]  # fmt: skip


def test_the_net_picture_has_every_face_and_crease_once():
    plan = small_plan()
    space = "{http://www.w3.org/2000/svg}"
    root = ElementTree.fromstring(net_svg(plan))  # noqa: S314  our own picture
    faces = [e for e in root.iter(f"{space}polygon") if e.get("data-face")]
    assert sorted(int(e.get("data-face")) for e in faces) == list(range(6))
    lines = {g.get("class"): list(g.iter(f"{space}line")) for g in root.iter(f"{space}g")}
    assert {kind: len(found) for kind, found in lines.items() if found} == {
        "cut": 8, "joint": 1, "mountain": 4, "tab": 1,
    }  # fmt: skip
    creases = {int(e.get("data-crease")): e for e in lines["mountain"]}
    assert sorted(creases) == [0, 1, 2, 3]
    assert [c for c, e in creases.items() if e.get("class") == "blocked"] == [1]
    for face in faces:
        shown = np.array([[float(v) for v in p.split(",")] for p in face.get("points").split()])
        wanted = plan.net.vertices[plan.net.faces[int(face.get("data-face"))]] * (1, -1)
        np.testing.assert_allclose(shown, wanted, atol=0.006)
