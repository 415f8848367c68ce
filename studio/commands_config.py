"""``blossom config`` and ``blossom completion``: flags where none are typed; completion for shells."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from studio.commands_lists import say
from studio.config_file import CONFIG_NAME, NEVER, all_flags, config_place, flag_names, read_config
from studio.errors import UsageError
from studio.exit_codes import DONE
from studio.flags import Json
from studio.options import option_text

if TYPE_CHECKING:
    from cyclopts.argument import Argument

__all__ = ["completion", "config"]


def config(
    path: Annotated[
        Path | None, Parameter(help="A mesh or a bundle: the file beside it counts [current folder].")
    ] = None,
    /,
    *,
    command: Annotated[str, Parameter(metavar="NAME", help="Command whose flags are shown.")] = "make",
    json: Json = False,
) -> int:
    """Show the flags of a command where none are typed: usual values, and those of blossom.toml.

    A file blossom.toml in the folder of the mesh, or in the folder that holds the bundle, sets flags for
    good. Keys are flags without hyphens in front; under [make] or another command they count for that one
    alone. What is typed wins. What arms, confirms or replaces is never taken from a file.

    Examples:
        blossom config

        blossom config bunny.obj --command plan
    """
    from studio.cli import app

    flags = all_flags(app)
    if command not in flags:
        raise UsageError(f"no command is called '{command}'; known: {', '.join(sorted(flags))}")
    place = config_place(path)
    found = read_config(place, flags)
    arguments = app[command].assemble_argument_collection()
    chosen = {} if found is None else found.for_command(command, flag_names(arguments))
    rows = [
        {"flag": name, "value": chosen.get(name, _default(argument)), "from": _source(name, chosen)}
        for argument in arguments
        for name in sorted(flag_names([argument]) - set(NEVER))
    ]
    if json:
        document = {
            "format": "metal-blossom/config", "version": 1, "file": str(place) if found else None,
            "command": command, "flags": rows,
        }  # fmt: skip
        say(json_text.dumps(document, ensure_ascii=False, allow_nan=False))
        return DONE
    say(f"{place}: {'found' if found else 'no such file, usual values'}\n")
    for row in rows:
        say(f"{row['flag']:<20}{option_text(row['value']):<24}{row['from']}".rstrip())
    return DONE


def completion(shell: Literal["bash", "zsh", "fish", "powershell"], /) -> int:
    """Print a script that completes commands and flags in a shell.

    Examples:
        blossom completion bash > ~/.local/share/bash-completion/completions/blossom

        blossom completion zsh > ~/.zfunc/_blossom
    """
    from studio.cli import app

    say(app.generate_completion(prog_name="blossom", shell=shell).rstrip("\n"))
    return DONE


def _default(argument: Argument) -> Any:  # noqa: ANN401  any flag's value
    value = argument.field_info.default
    if value is argument.field_info.empty:
        return None
    return list(value) if isinstance(value, tuple | list) else value


def _source(name: str, chosen: dict[str, Any]) -> str:
    return CONFIG_NAME if name in chosen else ""
