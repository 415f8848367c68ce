"""The ``blossom`` command."""

from __future__ import annotations

import inspect
import json
import os
import signal
import sys
from collections.abc import Callable, Sequence
from functools import partial
from types import FrameType

from cyclopts import App, CycloptsError, Parameter, UnusedCliTokensError

from studio import (
    commands_bench,
    commands_bend,
    commands_calibrate,
    commands_certify,
    commands_compare,
    commands_config,
    commands_emulate,
    commands_explain,
    commands_export,
    commands_guide,
    commands_lists,
    commands_make,
    commands_materials,
    commands_net,
    commands_replay_dump,
    commands_resume,
    commands_rigs,
    commands_scatter,
    commands_shadow,
    commands_stages,
    commands_testgrid,
    commands_trace,
    commands_view,
)
from studio.config_file import apply_config
from studio.exit_codes import BAD_INPUT, exit_code_of
from studio.messages import error_text
from studio.options import PROVE_S

__all__ = ["app", "main"]

HELP = """Fold sheet metal with a laser: from a 3-D mesh to a net, a proven fold plan and a laser job."""
EPILOGUE = """Start with: blossom demo
Then:       blossom make bunny.obj --size 60

Every command has --help. With --debug an error also shows where in the program it happened.
Exit codes: 0 done, 1 the verdict is no, 2 bad input or usage, 3 the machine, 70 internal error,
130 stopped by Ctrl-C."""


def _version() -> str:
    from importlib import metadata

    return f"metal-blossom {metadata.version('metal-blossom')}"


def _help_texts(command: Callable[..., int]) -> tuple[str, str]:
    """Help and epilogue of a command from its docstring: paragraphs on one line each, examples last."""
    text, _, examples = inspect.cleandoc(command.__doc__ or "").partition("Examples:\n")
    paragraphs = [" ".join(part.split()) for part in text.strip().split("\n\n")]
    lines = [f"  {line.strip()}" for line in examples.splitlines() if line.strip()]
    return "\n\n".join(paragraphs), "\n".join(["Examples:", *lines])


app = App(
    name="blossom", help=HELP, help_epilogue=EPILOGUE, version=_version, help_format="plaintext",
    result_action="return_value", suppress_keyboard_interrupt=False,
    default_parameter=Parameter(negative=()),
)  # fmt: skip
for _command in (
    commands_make.make, commands_lists.check, commands_net.net, commands_stages.plan,
    commands_certify.certify, commands_stages.validate, commands_stages.job, commands_stages.replay,
    commands_resume.resume, commands_shadow.shadow, commands_trace.trace, commands_replay_dump.replay_dump,
    commands_stages.report, commands_view.view, commands_export.export, commands_guide.guide,
    commands_compare.compare,
    commands_explain.explain, commands_scatter.scatter, commands_bend.bend,
    commands_testgrid.testgrid, commands_calibrate.calibrate,
    commands_emulate.emulate, commands_rigs.rigs, commands_materials.materials, commands_make.demo,
    commands_bench.bench,
    commands_config.config, commands_config.completion,
):  # fmt: skip
    _help, _epilogue = _help_texts(_command)
    app.command(_command, help=_help, help_epilogue=_epilogue, sort_key=len(list(app)))


app.config = (partial(apply_config, app),)  # blossom.toml beside the mesh

_PROVE = "--prove"


def _with_seconds(words: list[str], end: int) -> list[str]:
    """``--prove`` may stand alone; then it gets its usual seconds. ``end``: where options end."""
    out = []
    words = list(words)
    for index, word in enumerate(words):
        follows = words[index + 1] if index + 1 < end else ""
        if word == _PROVE and index < end and not _is_number(follows):
            word = f"{_PROVE}={PROVE_S:g}"
        out.append(word)
    return out


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with ``arguments`` (those of the process if not given); returns the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    end = words.index("--") if "--" in words else len(words)
    debug = "--debug" in words[:end]
    words = [word for index, word in enumerate(words) if word != "--debug" or index >= end]
    as_json = "--json" in words[:end]
    words = _with_seconds(words, words.index("--") if "--" in words else len(words))
    _stop_like_ctrl_c()
    try:
        code = app(words, exit_on_error=False, print_error=False)
        sys.stdout.flush()
    except CycloptsError as error:
        return _tell(f"error: {_usage_text(error)}", BAD_INPUT, as_json)
    except BrokenPipeError:
        # Whoever read the output has gone; keep Python from complaining when it closes the stream.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BAD_INPUT
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001  the border: nobody above could handle it
        if debug:
            import traceback

            traceback.print_exc()
        return _tell(error_text(error), exit_code_of(error), as_json)
    return code if isinstance(code, int) else 0


def _usage_text(error: CycloptsError) -> str:
    if isinstance(error, UnusedCliTokensError):
        left = " ".join(error.unused_tokens or ())
        return f"do not know what to do with '{left}'; --help shows what the command takes"
    return " ".join(str(error).split())


def _tell(text: str, code: int, as_json: bool) -> int:
    sys.stderr.write(f"{text}\n")
    if as_json:
        values = {
            "format": "metal-blossom/error",
            "version": 1,
            "error": {"message": text},
            "exit_code": code,
        }
        sys.stdout.write(json.dumps(values, ensure_ascii=False) + "\n")
    return code


def _stop_like_ctrl_c() -> None:
    """Let SIGTERM, and a terminal that goes away, clean up as Ctrl-C does."""

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    try:
        signal.signal(signal.SIGTERM, stop)
        hang_up = getattr(signal, "SIGHUP", None)
        if hang_up is not None and signal.getsignal(hang_up) != signal.SIG_IGN:  # ignored under nohup
            signal.signal(hang_up, stop)
    except ValueError:
        return  # not the main thread: the host of this call handles signals


if __name__ == "__main__":
    sys.exit(main())
