"""``blossom resume``: go on with a job where its last replay stopped."""

from __future__ import annotations

from typing import Annotated, Literal

from cyclopts import Parameter

from studio.commands_view import ViewPort
from studio.exit_codes import DONE
from studio.flags import Bundle, Encoder, Json, Port, Quiet, Shadow, View, Yes, finite
from studio.live_server import DEFAULT_PORT
from studio.progress import Progress
from studio.summary import print_summary

__all__ = ["resume"]


def resume(
    bundle: Bundle,
    /,
    *,
    port: Port,
    doubt: Annotated[
        Literal["done", "redo", "abandon"] | None,
        Parameter(
            metavar="done|redo|abandon",
            help=(
                "The block in doubt: count it as burnt, burn it again (cuts only), or leave its "
                "crease as it is."
            ),
        ),
    ] = None,
    angle: Annotated[
        float | None,
        Parameter(
            metavar="DEG", validator=finite, help="Measured angle of the crease in doubt; sets what is left."
        ),
    ] = None,
    look: Annotated[
        bool, Parameter(show_default=False, help="Only say how far the job has come; nothing is sent.")
    ] = False,
    shadow: Shadow = False,
    measure: Annotated[
        str | None,
        Parameter(
            metavar="typed|URL|FILE",
            help="Measure each crease after its passes, as blossom replay does; needed where it did.",
        ),
    ] = None,
    encoder: Encoder = None,
    view: View = False,
    view_port: ViewPort = DEFAULT_PORT,
    yes: Yes = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Go on with a job where its last armed replay stopped, at a block boundary.

    The machine is homed first if it asks for it, and the pilot light runs over the marks of the sheet.
    Blocks that were confirmed are never sent again, and a fold pass that may have burnt is never repeated.
    Ctrl-Z holds the machine, Ctrl-C stops it.

    Examples:
        blossom resume out/bunny --port /dev/ttyUSB0 --look

        blossom resume out/bunny --port /dev/ttyUSB0 --angle 38
    """
    from studio.pipeline import resume_bundle
    from studio.replay_stage import check_measure
    from studio.resume_stage import Beside, Choice

    check_measure(measure, port)
    beside = Beside(shadow, measure, encoder, view_port if view else None)
    summary = resume_bundle(
        bundle,
        port,
        Choice(doubt, angle),
        yes=yes,
        look_only=look,
        beside=beside,
        progress=Progress(quiet=quiet or json),
    )
    print_summary(summary, as_json=json)
    return DONE
