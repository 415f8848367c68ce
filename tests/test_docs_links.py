"""Links between the documents lead somewhere, and the table of packages is the one that is enforced."""

from __future__ import annotations

import re

import pytest

from tests.test_import_arrows import ALLOWED

LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


def documents(repository):
    return [
        *repository.glob("*.md"),
        *(repository / "docs").rglob("*.md"),
        *(repository / "models").rglob("*.md"),
    ]


def anchors(text: str) -> set[str]:
    """Anchors of the headings as GitHub makes them: lower case, spaces to hyphens, other signs dropped."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def test_relative_links_lead_to_files_and_headings(repository):
    broken = []
    for document in documents(repository):
        for target in LINK.findall(document.read_text(encoding="utf-8")):
            if re.match(r"[a-z]+:", target):
                continue
            name, _, anchor = target.partition("#")
            file = (document.parent / name).resolve() if name else document
            if not file.exists() or (anchor and anchor not in anchors(file.read_text(encoding="utf-8"))):
                broken.append(f"{document.relative_to(repository)}: {target}")
    assert broken == []


def test_every_page_can_be_reached_from_the_readme(repository):
    seen, todo = set(), [(repository / "README.md").resolve()]
    while todo:
        page = todo.pop()
        seen.add(page)
        for target in LINK.findall(page.read_text(encoding="utf-8")):
            file = (page.parent / target.partition("#")[0]).resolve()
            if file.suffix == ".md" and file.is_file() and file not in seen:
                todo.append(file)
    pages = {page.resolve() for page in (repository / "docs").rglob("*.md")}
    assert sorted(str(page.relative_to(repository)) for page in pages - seen) == []


@pytest.mark.parametrize("package", ["planner", "rigs", "twin", "models", "studio"])
def test_the_table_of_packages_is_the_one_that_is_enforced(repository, package):
    text = (repository / "docs" / "architecture.md").read_text(encoding="utf-8")
    (row,) = re.findall(rf"^\| `{package}/` \|.*\| ([^|]*) \|$", text, re.MULTILINE)
    everything = set(ALLOWED) - {package}
    told = {"nothing of ours": set(), "all of the above": everything}.get(
        row, set(re.findall(r"`(\w+)`", row))
    )
    assert told == ALLOWED[package]
