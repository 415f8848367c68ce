"""``blossom view``: the plan of a bundle in a live view."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from studio.exit_codes import DONE
from studio.flags import Bundle
from studio.live_server import DEFAULT_PORT

__all__ = ["ViewPort", "check_port", "view"]


def check_port(_kind: object, value: int | None) -> None:
    """Refuse what is no port that a program of a user may open."""
    if value is not None and not 1024 <= value <= 65535:
        raise ValueError("must be a port from 1024 to 65535.")


ViewPort = Annotated[
    int,
    Parameter(
        metavar="N",
        validator=check_port,
        help="Port of the live view on this computer; if it is taken, one of the next.",
    ),
]


def view(bundle: Bundle, /, *, view_port: ViewPort = DEFAULT_PORT) -> int:
    """Scrub through a plan in a browser: a page that this computer serves to itself alone.

    Needs the extra "view" (pip install 'metal-blossom[view]'). Ctrl-C ends it.

    Examples:
        blossom view out/bunny
    """
    from studio.bundle_check import open_manifest
    from studio.commands_lists import say
    from studio.live_stage import view_plan
    from studio.workspace import Workspace

    def told(url: str) -> None:
        say(f"live view: {url} (Ctrl-C ends it)")

    try:
        view_plan(Workspace(bundle, open_manifest(bundle)), view_port, say=told, goes_on=lambda: True)
    except KeyboardInterrupt:
        say("closed")
    return DONE
