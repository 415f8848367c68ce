"""Where a report comes from: hashes, versions, seed, parameters and the commands that make it again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape

from studio.manifest import Manifest
from studio.report_command import command_lines

__all__ = ["provenance_html"]


def provenance_html(manifest: Manifest) -> str:
    """Everything at the bottom of the page."""
    files = [(name, str(entry["sha256"])) for name, entry in sorted(manifest.files.items())]
    files = [(name, sha) for name, sha in files if manifest.files[name].get("stage") != "report"]
    inputs = [
        (f"input {manifest.input.get('name', '')}", str(manifest.input.get("sha256", ""))),
        (f"rig {manifest.rig.get('name', '')}", str(manifest.rig.get("sha256", ""))),
        (f"material {manifest.material.get('name', '')}", str(manifest.material.get("sha256", ""))),
    ]
    runs = [("seed", str(manifest.seed))]
    runs += [(stage, _plain(values) or "defaults") for stage, values in sorted(manifest.parameters.items())]
    versions = sorted(manifest.versions.items())
    lines = "\n".join(escape(line) for line in command_lines(manifest))
    return (
        f'<div><h2>Command</h2><pre id="command">{lines}</pre>'
        f"<h2>Files (sha256)</h2>{_table([*inputs, *files], code=True)}</div>"
        f"<div><h2>Parameters</h2>{_table(runs)}<h2>Versions</h2>{_table(versions)}</div>"
    )


def _table(rows: Sequence[tuple[str, str]], *, code: bool = False) -> str:
    mark = ' class="hash"' if code else ""
    body = "".join(f"<tr><td>{escape(name)}</td><td{mark}>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table><tbody>{body}</tbody></table>"


def _plain(value: object) -> str:
    """A JSON value as short text."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Mapping):
        return ", ".join(
            f"{str(k).replace('_', ' ')} {_plain(v)}" for k, v in sorted(value.items()) if v not in (None, "")
        )
    if isinstance(value, Iterable) and not isinstance(value, str):
        items = list(value)
        shown = ", ".join(_plain(item) for item in items[:12])
        return f"{shown} … ({len(items)})" if len(items) > 12 else shown or "none"
    return "" if value is None else str(value)
