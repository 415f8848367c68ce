"""``blossom.toml``: flags that a project always uses, in a file beside the mesh; flags typed by hand win."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.errors import UsageError

if TYPE_CHECKING:
    from cyclopts import App
    from cyclopts.argument import Argument, ArgumentCollection

__all__ = [
    "CONFIG_NAME", "NEVER", "Config", "all_flags", "apply_config", "config_place", "flag_names",
    "read_config",
]  # fmt: skip

CONFIG_NAME = "blossom.toml"

NEVER = ("arm", "yes", "force", "output", "json", "debug", "help", "version")
"""Flags that a file must not set: a person arms a laser and replaces folders, each time anew."""

_FILES = ("rig", "material")
"""Flags whose value may be a file; it then lies where the configuration lies."""


@dataclass(frozen=True)
class Config:
    """A configuration file that was read.

    Attributes:
        path: the file.
        common: flag → value for every command that has the flag.
        commands: command → flag → value for that command alone.
    """

    path: Path
    common: Mapping[str, Any]
    commands: Mapping[str, Mapping[str, Any]]

    def for_command(self, command: str, flags: set[str]) -> dict[str, Any]:
        """Flag → value for one command; what stands under its own heading wins.

        Args:
            command: its name.
            flags: names of the flags that it has.
        """
        values = {name: value for name, value in self.common.items() if name in flags}
        return values | dict(self.commands.get(command, {}))


def config_place(path: Path | None) -> Path:
    """Where the configuration of a mesh or a bundle is looked for: in the folder that holds it.

    Args:
        path: of a mesh file or of a bundle's folder; None takes the current folder.
    """
    return (Path() if path is None else path.parent) / CONFIG_NAME


def read_config(place: Path, flags: Mapping[str, set[str]]) -> Config | None:
    """Read and check a configuration; None where there is no such file.

    Args:
        place: the file.
        flags: command → names of the flags that it has.

    Raises:
        UsageError: naming the file and the first mistake in it, and the nearest right name.
    """
    try:
        data = tomllib.loads(place.read_bytes().decode("utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except UnicodeDecodeError as error:
        raise UsageError(f"{place}: not UTF-8 text (byte {error.start})") from error
    except tomllib.TOMLDecodeError as error:
        raise UsageError(f"{place}: not valid TOML: {error}") from error
    except OSError as error:
        raise UsageError(f"{place}: cannot be read: {error.strerror or error}") from error
    everything = set().union(*flags.values())
    common, commands = {}, {}
    for name, value in data.items():
        if isinstance(value, dict):
            if name not in flags:
                raise UsageError(f"{place}: [{name}] is no command{_nearest(name, flags)}")
            for key in value:
                _check(place, f"[{name}] ", key, flags[name], f"flag of blossom {name}")
            commands[name] = {key: _with_place(place, key, v) for key, v in value.items()}
        else:
            _check(place, "", name, everything, "flag of any command")
            common[name] = _with_place(place, name, value)
    return Config(place, common, commands)


def _check(place: Path, where: str, key: str, known: set[str], kind: str) -> None:
    if key in NEVER:
        raise UsageError(f"{place}: {where}{key} cannot be set in a file: type --{key} each time you mean it")
    if key not in known:
        raise UsageError(f"{place}: {where}{key} is no {kind}{_nearest(key, known)}")


def _nearest(name: str, known: Mapping[str, Any] | set[str]) -> str:
    near = difflib.get_close_matches(name, sorted(known), 1)
    return f"; did you mean {near[0]}?" if near else f"; known: {', '.join(sorted(set(known) - set(NEVER)))}"


def _with_place(place: Path, key: str, value: Any) -> Any:  # noqa: ANN401  any TOML value
    """A profile file that is named relative to the configuration, relative to the current folder."""
    if key in _FILES and isinstance(value, str) and ".toml" in value:
        return str(place.parent / value)
    return value


def flag_names(arguments: Iterable[Argument]) -> set[str]:
    """Names of the flags of a command, without their hyphens in front."""
    return {_long_name(a) for a in arguments if _long_name(a)}


def _long_name(argument: Argument) -> str:
    return next((name[2:] for name in argument.names if name.startswith("--")), "")


def apply_config(root: App, app: App, commands: tuple[str, ...], arguments: ArgumentCollection) -> None:
    """Give flags that were not typed the values of the configuration.

    Args:
        root: the whole program.
        app: the command; with the next two, what cyclopts hands to a source of configuration.
        commands: its name.
        arguments: its arguments, with what was typed.

    Raises:
        UsageError: if the file is wrong.
    """
    from cyclopts.config import Dict

    place = config_place(_first_path(arguments))
    if not commands or commands[-1] == "config" or not place.is_file():
        return
    config = read_config(place, all_flags(root))
    if config is not None:
        values = config.for_command(commands[-1], flag_names(arguments))
        Dict(data=values, source=str(place), use_commands_as_keys=False)(app, commands, arguments)


def _first_path(arguments: ArgumentCollection) -> Path | None:
    """Path of the mesh or of the bundle that was typed."""
    for argument in arguments:
        if argument.hint in (Path, Path | None) and not _long_name(argument) and argument.tokens:
            return Path(argument.tokens[0].value)
    return None


def all_flags(root: App) -> dict[str, set[str]]:
    """Command → names of the flags that it has."""
    return {
        name: flag_names(root[name].assemble_argument_collection())
        for name in root
        if not name.startswith("-")
    }
