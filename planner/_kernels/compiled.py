"""How the kernels are compiled and where their machine code is kept between runs.

Numba keys its cache by the source file of a function, so it does not notice when a function in another file, which
was compiled into it, has changed. Here the machine code of all kernels lies in one directory whose name is a hash
over all kernel sources and whatever else it depends on: after an upgrade or an edit it starts empty.

Kernels copy arrays by loops: for an assignment of one array to another numba also compiles the writing of the
message of the error that it might raise, which takes one to two seconds.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
from numba.types import unliteral

__all__ = ["KERNELS", "cache_directory", "entry", "find_cache_directory", "inner", "kernel_is_cached"]

SOURCES = Path(__file__).parent
"""The directory of all kernel sources."""

KEPT_DIRECTORIES = 4
"""How many directories of other versions are left beside the one in use, the newest ones."""

_PREFIX = "metal-blossom-"

KERNELS: list[Any] = []
"""The kernels that Python calls, in the order in which they were defined."""


def version_key() -> str:
    """Hash of all that the machine code depends on: kernel sources, Python, numba, processor; 16 digits."""
    digest = hashlib.sha256()
    for part in (sys.version, numba.__version__, llvmlite.__version__, llvmlite.binding.get_host_cpu_name()):
        digest.update(part.encode() + b"\0")
    for file in sorted(SOURCES.glob("*.py")):
        digest.update(file.name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()[:16]


def find_cache_directory() -> Path | None:
    """Directory for the machine code, made if need be; None if there is no place that can be written to.

    Tried are the directory that ``NUMBA_CACHE_DIR`` names, ``__pycache__`` beside the sources, and the user's
    directory for caches. All but the newest directories of other versions beside it are removed.
    """
    given = numba.config.CACHE_DIR
    for parent in (Path(given) if given else None, SOURCES / "__pycache__", _user_cache()):
        if parent is None:
            continue
        directory = parent / (_PREFIX + version_key())
        is_new = not directory.exists()
        try:
            directory.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=directory).close()
        except OSError:
            continue
        if is_new:
            _forget_old(directory)
        return directory
    return None


def _user_cache() -> Path | None:
    """The user's directory for caches; None if the user has no home."""
    if sys.platform == "win32":
        return Path(os.environ["LOCALAPPDATA"]) if "LOCALAPPDATA" in os.environ else None
    given = os.environ.get("XDG_CACHE_HOME", "")
    if Path(given).is_absolute():
        return Path(given)
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / ("Library/Caches" if sys.platform == "darwin" else ".cache")


def _forget_old(directory: Path) -> None:
    """Remove all but the newest directories of other versions beside ``directory``."""
    with suppress(OSError):
        others = [(p.stat().st_mtime, p) for p in directory.parent.glob(_PREFIX + "*") if p != directory]
        for _, old in sorted(others, reverse=True)[KEPT_DIRECTORIES:]:
            shutil.rmtree(old, ignore_errors=True)


cache_directory = find_cache_directory()
"""Where this process finds and leaves machine code; None if it compiles for itself only."""


def _one_for_all_literals(kernel: Any) -> Any:
    """Let kernels that call ``kernel`` share one version of it: numba compiles one for each literal otherwise."""
    template = kernel.get_call_template

    def get_call_template(args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
        return template(tuple(map(unliteral, args)), {name: unliteral(kind) for name, kind in kws.items()})

    kernel.get_call_template = get_call_template
    return kernel


def _compiled(*, keep: bool, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator that compiles a function on its first call; ``keep``: and leaves it in ``cache_directory``."""

    def decorate(function: Callable[..., Any]) -> Any:
        before = numba.config.CACHE_DIR
        if cache_directory is not None:
            numba.config.CACHE_DIR = str(cache_directory)  # read while the decorator runs
        try:
            kernel = numba.njit(
                cache=keep and cache_directory is not None, error_model="numpy", nogil=True, **options
            )(function)
            return _one_for_all_literals(kernel)
        finally:
            numba.config.CACHE_DIR = before

    return decorate


# wrappers that nobody calls cost time to compile
_inner = _compiled(keep=False, no_cfunc_wrapper=True, no_cpython_wrapper=True)
_entry = _compiled(keep=True, no_cfunc_wrapper=True)


def inner(function: Callable[..., Any]) -> Any:
    """Compile a kernel that is called by kernels only."""
    return _inner(function)


def entry(function: Callable[..., Any]) -> Any:
    """Compile a kernel that is called from Python (and from kernels)."""
    kernel = _entry(function)
    KERNELS.append(kernel)
    return kernel


def kernel_is_cached(kernel: Any) -> bool:
    """True if ``kernel`` need not be compiled: its machine code is on disk, or in this process already."""
    if kernel.signatures:
        return True
    name = f"{kernel.__module__.rpartition('.')[2]}.{kernel.__name__}-*.nbi"
    return cache_directory is not None and any(Path(kernel.stats.cache_path).glob(name))
