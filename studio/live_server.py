"""The server of the live view: viser, bound to this computer alone."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from typing import Any

from studio.errors import StudioError

__all__ = ["DEFAULT_PORT", "HOST", "ViewError", "live_server", "url_of"]

HOST = "127.0.0.1"
"""The view listens here and nowhere else: nobody on the network sees or moves it."""

DEFAULT_PORT = 8080
"""Where it listens unless told; taken ports are passed over."""


class ViewError(StudioError, RuntimeError):
    """There can be no live view on this computer (exit code 2)."""


@contextlib.contextmanager
def live_server(title: str, port: int = DEFAULT_PORT) -> Iterator[Any]:
    """A viser server on the loopback address while the block runs.

    Args:
        title: of the page.
        port: where to listen; if it is taken, one of the next.

    Raises:
        ViewError: if viser is not installed, or no port is free.
    """
    try:
        import viser
    except ImportError as error:
        raise ViewError(
            "the live view needs viser, which is not installed: pip install 'metal-blossom[view]' "
            "(report.html shows the plan without it)"
        ) from error
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # it greets on standard output
            server = viser.ViserServer(host=HOST, port=port, label=title, verbose=False)
    except (OSError, RuntimeError, OverflowError, AssertionError) as error:
        raise ViewError(
            f"cannot listen on {HOST}, port {port}: {error}; choose another --view-port"
        ) from error
    try:
        server.scene.set_up_direction("+z")
        server.gui.set_panel_label(title)
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def url_of(server: Any) -> str:  # noqa: ANN401  viser
    """Address of the page."""
    return f"http://{HOST}:{server.get_port()}"
