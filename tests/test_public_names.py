"""Every public name exists, says what it is, and is listed once."""

from __future__ import annotations

import ast
import importlib
import inspect
import subprocess
import sys

import pytest

PACKAGES = ("planner", "rigs", "twin", "studio", "models")


def module_names(repository) -> list[str]:
    """All modules of the product by their import names, scripts for ``python -m`` left out."""
    names = []
    for package in PACKAGES:
        for file in sorted((repository / package).rglob("*.py")):
            parts = file.relative_to(repository).with_suffix("").parts
            if parts[-1] != "__main__":
                names.append(".".join(parts[:-1] if parts[-1] == "__init__" else parts))
    return names


def test_every_name_in_all_can_be_imported(repository):
    wrong = []
    for name in module_names(repository):
        module = importlib.import_module(name)
        exported = list(getattr(module, "__all__", []))
        wrong += [f"{name}.{entry}" for entry in exported if not hasattr(module, entry)]
        wrong += [f"{name}: {entry} twice" for entry in set(exported) if exported.count(entry) > 1]
    assert wrong == []


def test_every_module_and_public_object_has_a_docstring(repository):
    bare = []
    for name in module_names(repository):
        module = importlib.import_module(name)
        if not (module.__doc__ or "").strip():
            bare.append(name)
        for entry in getattr(module, "__all__", []):
            value = getattr(module, entry, None)
            if (inspect.isfunction(value) or inspect.isclass(value)) and not (value.__doc__ or "").strip():
                bare.append(f"{name}.{entry}")
    assert bare == []


@pytest.mark.parametrize("package", ["planner", "rigs", "twin"])
def test_star_import_of_a_package_works(package):
    names: dict[str, object] = {}
    exec(f"from {package} import *", names)  # noqa: S102 -- a fixed text, and the thing to be tested
    module = importlib.import_module(package)
    for entry in getattr(module, "__all__", []):
        assert names[entry] is getattr(module, entry)


@pytest.mark.parametrize("modules_first", [False, True])
@pytest.mark.parametrize("package", ["planner", "rigs", "twin"])
def test_public_names_are_the_objects_whatever_was_imported_before(package, modules_first):
    """Some functions are named like their module, which must not come instead."""
    code = (
        "import importlib, sys, types\n"
        "package, modules_first = sys.argv[1], sys.argv[2] == 'True'\n"
        "modules = importlib.import_module(package)._MODULES\n"
        "if modules_first:\n"
        "    for module in sorted(set(modules.values())): importlib.import_module(module)\n"
        "for name, module in modules.items():\n"
        "    for _ in range(2):\n"
        "        space = {}\n"
        "        exec(f'from {package} import {name} as it', space)\n"
        "        assert not isinstance(space['it'], types.ModuleType), name\n"
        "        assert space['it'] is getattr(importlib.import_module(module), name), name\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, package, str(modules_first)], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr


def test_each_package_has_one_root_error_with_a_builtin_beside_it(repository):
    for package, root_name in (("planner", "PlannerError"), ("rigs", "RigError"), ("twin", "TwinError")):
        errors = importlib.import_module(f"{package}.errors")
        root = getattr(errors, root_name)
        assert root.__bases__ == (Exception,)
        tree = ast.parse((repository / package / "errors.py").read_text(encoding="utf-8"))
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and node.name != root_name:
                kind = getattr(errors, node.name)
                assert issubclass(kind, root), node.name
                builtin = [base for base in kind.__mro__ if base.__module__ == "builtins"]
                assert builtin[0] is not Exception, f"{node.name} mixes in no built-in error"
