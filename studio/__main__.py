"""Start of the ``blossom`` command: a Ctrl-C that comes while it still loads ends in words too."""

from __future__ import annotations

import sys

__all__ = ["main"]


def main() -> int:
    """Run the command with the arguments of the process; returns the exit code."""
    try:
        from studio.cli import main as run
    except KeyboardInterrupt as error:
        from studio.exit_codes import INTERRUPTED
        from studio.messages import error_text

        sys.stderr.write(f"{error_text(error)}\n")
        return INTERRUPTED
    return run()


if __name__ == "__main__":
    sys.exit(main())
