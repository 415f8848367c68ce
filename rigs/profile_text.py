"""Profiles as TOML text: found by name or path, read strictly, the place of every mistake named."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterator
from importlib import resources
from pathlib import Path
from typing import TypeVar

import msgspec

from rigs.errors import ProfileError, UnknownNameError

__all__ = ["all_mistakes", "parse_profile", "profile_names", "profile_text"]

T = TypeVar("T", bound=msgspec.Struct)


def profile_names(folder: str) -> tuple[str, ...]:
    """Names of the profiles that ship in ``rigs/<folder>``, sorted."""
    files = (resources.files("rigs") / folder).iterdir()
    return tuple(sorted(p.name.removesuffix(".toml") for p in files if p.name.endswith(".toml")))


def profile_text(kind: str, folder: str, name_or_path: str | Path) -> tuple[str, str]:
    """Text of a shipped profile by name or of a file by path, and what to call it in messages.

    Raises:
        UnknownNameError: no shipped profile has the name.
        ProfileError: the file cannot be read.
    """
    text = str(name_or_path)
    if isinstance(name_or_path, str) and text in (names := profile_names(folder)):
        return (resources.files("rigs") / folder / f"{text}.toml").read_text("utf-8"), f"{kind} {text}"
    path = Path(name_or_path)
    if isinstance(name_or_path, str) and path.suffix != ".toml" and path.name == text and not path.is_file():
        raise UnknownNameError(kind, text, names)
    try:
        return path.read_text("utf-8"), str(path)
    except UnicodeDecodeError as error:
        raise ProfileError(
            f"{path}: not UTF-8 text (byte {error.start}): save the profile as UTF-8"
        ) from error
    except (OSError, ValueError) as error:  # ValueError: a path with a zero byte
        reason = getattr(error, "strerror", None) or error
        raise ProfileError(f"{path}: cannot read the {kind} profile: {reason}") from error


def parse_profile(text: str, kind: type[T], mistakes: Callable[[T], Iterator[str]], source: str) -> T:
    """Read a profile of type ``kind`` from TOML text; ``source`` names it in messages.

    Args:
        text: TOML.
        kind: the msgspec struct to make.
        mistakes: what is wrong with values that have the right types, each as ``$.place: what``.
        source: what to call the profile in messages.

    Raises:
        ProfileError: with the path of the first wrong value, such as ``$.laser.power_curve``.
    """
    try:
        data = tomllib.loads(text)
        wild = _not_finite(data, "$")
    except tomllib.TOMLDecodeError as error:
        raise ProfileError(f"{source}: not valid TOML: {error}") from error
    except RecursionError as error:
        raise ProfileError(f"{source}: nested too deeply to be a profile") from error
    if wild:
        raise ProfileError(f"{source}: {wild}: must be a finite number")
    try:
        profile = msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        what, _, place = str(error).partition(" - at ")
        raise ProfileError(f"{source}: {place.strip('`') or '$'}: {what}") from error
    if mistake := next(mistakes(profile), None):
        raise ProfileError(f"{source}: {mistake}")
    return profile


def all_mistakes(
    text: str, kind: type[T], mistakes: Callable[[T], Iterator[str]], source: str
) -> tuple[str, ...]:
    """Every mistake of a profile in words; a text that is no profile of ``kind`` at all has one."""
    try:
        parse_profile(text, kind, lambda _profile: iter(()), source)
    except ProfileError as error:
        return (str(error).removeprefix(f"{source}: "),)
    return tuple(mistakes(msgspec.convert(tomllib.loads(text), kind)))


def _not_finite(value: object, path: str) -> str | None:
    """Path of the first number in ``value`` that is not finite."""
    if isinstance(value, float):
        return None if math.isfinite(value) else path
    items: list[tuple[str, object]] = []
    if isinstance(value, dict):
        items = [(f"{path}.{key}", item) for key, item in value.items()]
    elif isinstance(value, list):
        items = [(f"{path}[{index}]", item) for index, item in enumerate(value)]
    return next((found for place, item in items if (found := _not_finite(item, place))), None)
