"""The site builds without a warning, every page is in it, and every link of its pages leads somewhere."""

from __future__ import annotations

import ast
import html
import html.parser
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent


class Links(html.parser.HTMLParser):
    """Local targets of a page, and its ids."""

    def __init__(self) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.ids: set[str] = set()

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in ("href", "src") and value and ":" not in value and not value.startswith("//"):
                self.targets.append(unquote(value))
            if name == "id" and value:
                self.ids.add(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    if importlib.util.find_spec("mkdocs") is None:
        pytest.fail("mkdocs-material is not installed; the test extra has it")
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(folder)],
        cwd=REPOSITORY, capture_output=True, text=True, timeout=600,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_every_page_of_the_repository_is_a_page_of_the_site(site):
    pages = {p.relative_to(REPOSITORY / "docs") for p in (REPOSITORY / "docs").rglob("*.md")}
    made = {p.relative_to(site).with_suffix(".md") for p in site.rglob("*.html")}
    assert pages <= made
    assert {Path(name) for name in ("index.md", "security.md", "contributing.md", "changelog.md")} <= made
    assert not list(site.rglob("*.py"))


def test_links_lead_to_files_and_places(site):
    parsed = {}
    for page in site.rglob("*.html"):
        parsed[page.resolve()] = links = Links()
        links.feed(page.read_text("utf-8"))
    broken = []
    for page, links in parsed.items():
        if page.name == "404.html":
            continue
        for target in links.targets:
            name, _, anchor = target.partition("#")
            goal = (page.parent / name.partition("?")[0]).resolve() if name else page
            if not goal.exists() or (anchor and goal in parsed and anchor not in parsed[goal].ids | {""}):
                broken.append(f"{page.relative_to(site)}: {target}")
    assert broken == []


def test_examples_and_api_stand_in_their_pages(site):
    page = re.sub(r"<[^>]*>", "", (site / "examples.html").read_text("utf-8"))
    page = " ".join(html.unescape(page).split())
    for file in (REPOSITORY / "examples").glob("*.py"):
        assert file.stem in page
        words = ast.get_docstring(ast.parse(file.read_text("utf-8"))).split(":")[0]
        assert words in page
    for package, name in (("planner", "make_net"), ("rigs", "make_job"), ("twin", "validate")):
        page = (site / "api" / f"{package}.html").read_text("utf-8")
        assert f'id="{package}.' in page
        assert f">{name}<" in page


@pytest.mark.parametrize("package", ["planner", "rigs", "twin"])
def test_the_api_page_lists_all_public_names(package):
    import importlib

    module = importlib.import_module(package)
    text = (REPOSITORY / "docs" / "api" / f"{package}.md").read_text("utf-8")
    listed = {line.rpartition(".")[2] for line in text.splitlines() if line.startswith("::: ")}
    assert listed == {name for name in module.__all__ if not name.startswith("_")}


def test_the_pictures_of_the_concepts_are_what_their_script_draws(tmp_path, monkeypatch):
    from docs import make_concepts

    monkeypatch.setattr(make_concepts, "FOLDER", tmp_path)
    make_concepts.main()
    drawn = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    assert len(drawn) == 4
    for name, data in drawn.items():
        assert (REPOSITORY / "docs" / "pictures" / name).read_bytes() == data
