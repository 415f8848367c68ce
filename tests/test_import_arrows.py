"""Who may import whom, and what may be loaded before it is needed."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

# The table of docs/architecture.md. Whatever it does not list is forbidden.
ALLOWED = {
    "planner": set(),
    "models": set(),
    "rigs": {"planner"},
    "twin": {"planner", "rigs", "models"},
    "studio": {"planner", "rigs", "twin", "models"},
}

# Slow to load, so never loaded by importing a package or by asking the command for help.
HEAVY = {"mujoco", "pymeshlab", "trimesh", "numba", "shapely", "ezdxf", "scipy", "serial", "networkx"}
LIGHT_IMPORTS = ("planner", "rigs", "twin", "studio", "models.goals", "studio.cli")


def imports(tree: ast.AST, module: str, is_package: bool) -> Iterator[tuple[int, str]]:
    """Line and absolute name of every import anywhere in a module, in functions too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            base = module.split(".")
            if node.level:
                base = base[: len(base) - node.level + (1 if is_package else 0)]
                yield node.lineno, ".".join([*base, node.module or ""]).rstrip(".")
            else:
                yield node.lineno, node.module or ""
        elif isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if (
                name in {"import_module", "__import__"}
                and node.args
                and isinstance(node.args[0], ast.Constant)
            ):
                yield node.lineno, str(node.args[0].value)


def forbidden_arrows(source: str, module: str, is_package: bool = False) -> list[str]:
    """Imports of a module that the table does not have, as texts."""
    package = module.split(".")[0]
    return [
        f"{module}, line {line}: {package} must not import {name}"
        for line, name in imports(ast.parse(source), module, is_package)
        if (target := name.split(".")[0]) in ALLOWED and target != package and target not in ALLOWED[package]
    ]


def modules(repository: Path, package: str) -> list[Path]:
    return sorted((repository / package).rglob("*.py"))


@pytest.mark.parametrize("package", ALLOWED)
def test_packages_import_only_what_the_table_allows(repository, package):
    files = modules(repository, package)
    assert files, f"package {package} is gone"
    wrong = []
    for file in files:
        parts = file.relative_to(repository).with_suffix("").parts
        is_package = parts[-1] == "__init__"
        module = ".".join(parts[:-1] if is_package else parts)
        wrong += forbidden_arrows(file.read_text(encoding="utf-8"), module, is_package)
    assert wrong == []


def test_tests_and_benchmarks_are_imported_by_no_package(repository):
    wrong = [
        f"{file.relative_to(repository)}, line {line}: {name}"
        for package in ALLOWED
        for file in modules(repository, package)
        for line, name in imports(ast.parse(file.read_text(encoding="utf-8")), package, False)
        if name.split(".")[0] in {"tests", "benchmarks", "examples"}
    ]
    assert wrong == []


@pytest.mark.parametrize(
    ("source", "module"),
    [
        ("import twin", "planner.net"),
        ("from studio.cli import main", "planner.net"),
        ("def f():\n    import rigs.rig", "planner.net"),
        ("if TYPE_CHECKING:\n    from twin import Validation", "rigs.job"),
        ("importlib.import_module('studio.report')", "twin.sweep"),
        ("__import__('twin')", "rigs.job"),
        ("import os, studio", "twin.sweep"),
    ],
)
def test_the_walker_finds_every_kind_of_forbidden_import(source, module):
    assert len(forbidden_arrows(source, module)) == 1


@pytest.mark.parametrize(
    ("source", "module"),
    [
        ("from planner import Net", "twin.sweep"),
        ("from . import errors\nfrom .values import frozen_array", "planner.net"),
        ("import numpy as np\nfrom rigs.rig import Rig", "twin.heating"),
        ("'import twin'  # only a text", "planner.net"),
    ],
)
def test_the_walker_lets_allowed_imports_pass(source, module):
    assert forbidden_arrows(source, module) == []


@pytest.mark.parametrize("name", LIGHT_IMPORTS)
def test_importing_a_package_loads_nothing_heavy(repository, name):
    program = f"import json, sys; import {name}; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=repository, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    loaded = set(json.loads(done.stdout.splitlines()[-1]))
    assert sorted(loaded & HEAVY) == []


def test_asking_for_help_loads_nothing_heavy(repository):
    program = (
        "import json, sys\n"
        "sys.argv = ['blossom', '--help']\n"
        "from studio.cli import main\n"
        "try:\n    main()\nexcept SystemExit as stop:\n    assert not stop.code, stop.code\n"
        "print(json.dumps(sorted(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=repository, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    loaded = set(json.loads(done.stdout.splitlines()[-1]))
    assert sorted(loaded & HEAVY) == []


def test_only_one_module_loads_the_gpl_library(repository):
    users = {
        str(file.relative_to(repository))
        for package in ALLOWED
        for file in modules(repository, package)
        for _, name in imports(ast.parse(file.read_text(encoding="utf-8")), package, False)
        if name.split(".")[0] == "pymeshlab"
    }
    assert len(users) <= 1, f"pymeshlab (GPL-3) is to be loaded by one module only: {sorted(users)}"
