"""Public names of a package that load their module when they are used: importing it stays cheap."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from types import ModuleType

__all__ = ["lazy_names"]


def lazy_names(package: str, modules: Mapping[str, str]) -> Callable[[str], object]:
    """A module ``__getattr__`` that finds each public name of ``package`` in its module.

    Some functions are named as their module is (``planner.make_net``). Python binds a submodule to its
    package when it is imported, which would hide such a function; here the function is bound in its place.
    So ``planner.make_net`` always is the function; the module is ``sys.modules["planner.make_net"]``.

    Args:
        package: name of the package, which is being imported.
        modules: public name → name of the module that defines it.
    """

    class LazyPackage(ModuleType):
        """The package, with functions in the place of the modules that are named like them."""

        def __setattr__(self, name: str, value: object) -> None:
            """Bind ``name``, but to the public object if ``value`` is the module that defines it."""
            if isinstance(value, ModuleType) and modules.get(name) == value.__name__:
                value = getattr(value, name)
            super().__setattr__(name, value)

    def find(name: str) -> object:
        module = modules.get(name)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(importlib.import_module(module), name)

    sys.modules[package].__class__ = LazyPackage
    return find
