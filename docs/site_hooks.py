"""Hooks of the site: README, SECURITY and the like become pages, and links lead to them.

The pages are written so that they read well in the repository; the site only follows their links.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parent.parent
PAGES = {
    "README.md": "index.md", "SECURITY.md": "security.md", "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}  # fmt: skip
"""Files of the repository that are pages of the site."""
LINK = re.compile(r"(!?\[[^\]]*\]\()([^)\s#]+)(#[^)\s]*)?(\))")


def on_config(config: MkDocsConfig, **_: object) -> MkDocsConfig:
    """List every page of ``docs/commands`` under its heading."""
    pages = sorted(path.name for path in (ROOT / "docs" / "commands").glob("*.md"))
    for item in config.nav or []:
        if isinstance(item, dict) and "Commands" in item:
            item["Commands"] = [f"commands/{name}" for name in pages]
    return config


def on_files(files: Files, config: MkDocsConfig, **_: object) -> Files:
    """Add the pages that lie outside ``docs/``."""
    from mkdocs.structure.files import File

    for source, page in PAGES.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        files.append(File.generated(config, page, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, **_: object) -> str:
    """Turn links to pages into links of the site; files that are no pages are only named."""
    here = next((s for s, p in PAGES.items() if p == page.file.src_uri), f"docs/{page.file.src_uri}")

    def link(match: re.Match[str]) -> str:
        start, target, anchor, end = match.groups(default="")
        if re.match(r"[a-z]+:", target) or not target:
            return match.group(0)
        path = posixpath.normpath(posixpath.join(posixpath.dirname(here), target))
        if path in PAGES:
            goal = PAGES[path]
        elif path.startswith("docs/"):
            goal = path.removeprefix("docs/")
        elif config.repo_url:
            return f"{start}{config.repo_url.rstrip('/')}/blob/main/{path}{anchor}{end}"
        else:
            return start[1:-2]
        return start + posixpath.relpath(goal, posixpath.dirname(page.file.src_uri) or ".") + anchor + end

    return LINK.sub(link, markdown)
