"""Profiles written as TOML text that reads back as the same values."""

from __future__ import annotations

import json
from typing import Any

import msgspec

from rigs.rig import Profile

__all__ = ["profile_toml"]


def profile_toml(profile: Profile, heading: str = "") -> str:
    """TOML text of a rig or material profile.

    Args:
        profile: what to write.
        heading: lines for a comment at the top.
    """
    data: dict[str, Any] = msgspec.to_builtins(profile)
    lines = [f"# {line}" for line in heading.splitlines()]
    lines += [f"{_key(k)} = {_value(v)}" for k, v in data.items() if not isinstance(v, dict)]
    for name, section in data.items():
        if isinstance(section, dict):
            lines += _section(_key(name), section)
    return "\n".join(lines) + "\n"


def _section(path: str, section: dict[str, Any]) -> list[str]:
    lines = ["", f"[{path}]"]
    nested = []
    for key, value in section.items():
        if isinstance(value, dict) and not _small(value):
            nested += _section(f"{path}.{_key(key)}", value)
        else:
            lines.append(f"{_key(key)} = {_value(value)}")
    return lines + nested


def _small(value: dict[str, Any]) -> bool:
    return len(value) <= 3 and not any(isinstance(v, dict | list | tuple) for v in value.values())


def _key(name: str) -> str:
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else json.dumps(name)


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    raise TypeError(f"no TOML for {type(value).__name__}")
