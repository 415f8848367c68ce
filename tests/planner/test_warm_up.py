"""The first run: what is compiled, where it is kept, and when it is compiled again."""

import os
import shutil
import subprocess
import sys

import pytest

from planner import warm_up
from planner._kernels import compiled

STATE = """
from planner import warm_up
from planner._kernels.compiled import KERNELS, cache_directory
print(warm_up.kernels_are_cached(), cache_directory)
"""

WORK = """
import numpy as np, trimesh
from planner.fold_plan import MachineLimits
from planner.goal_mesh import GoalMesh
from planner.make_net import make_net
from planner.plan_folds import plan_folds
from planner._kernels.compiled import KERNELS
for mesh in (trimesh.creation.box((30, 20, 10)), trimesh.creation.icosphere(subdivisions=2, radius=20)):
    net = make_net(GoalMesh(mesh.vertices, mesh.faces, "goal"))
    plan_folds(net, MachineLimits(), budget_s=0.5)
print(sum(len(kernel.signatures) > 0 for kernel in KERNELS) > 10)
print([kernel.__name__ for kernel in KERNELS if sum(kernel.stats.cache_misses.values()) > 0])
"""


def run(code, folder, **settings):
    """Lines that a fresh interpreter prints which finds the packages in ``folder``."""
    environment = {**os.environ, "PYTHONPATH": str(folder), **settings}
    done = subprocess.run(
        [sys.executable, "-P", "-c", code],
        env=environment,
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


@pytest.fixture
def copied(repository, tmp_path):
    """A copy of the planner without any machine code."""
    folder = tmp_path / "site"
    shutil.copytree(repository / "planner", folder / "planner", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def test_after_warm_up_nothing_is_left_to_compile(repository, tmp_path):
    settings = {"NUMBA_CACHE_DIR": str(tmp_path)}
    assert run(STATE, repository, **settings)[0].startswith("False")
    run("from planner.warm_up import warm_up; warm_up()", repository, **settings)
    assert run(STATE, repository, **settings)[0].startswith("True")
    assert run(WORK, repository, **settings) == ["True", "[]"]


def test_warm_up_tells_how_far_it_is_and_only_the_first_time(monkeypatch):
    told, called = [], []
    monkeypatch.setattr(warm_up, "kernels_are_cached", lambda: len(called) == 2)
    monkeypatch.setitem(warm_up.PARTS, "nets", lambda: called.append("nets"))
    monkeypatch.setitem(warm_up.PARTS, "folds", lambda: called.append("folds"))
    monkeypatch.setattr(warm_up, "_start_child", lambda part, parent: None)
    warm_up.warm_up(lambda share, text: told.append((share, text)))
    assert called == ["nets", "folds"]
    assert [share for share, _ in told] == sorted(share for share, _ in told)
    assert told[-1][0] == 1.0
    count = len(told)
    warm_up.warm_up(lambda share, text: told.append((share, text)))
    assert (called, len(told)) == (["nets", "folds"], count)


def test_an_edit_of_any_kernel_source_starts_an_empty_cache(copied):
    def directory():
        return run(STATE, copied)[0].split(" ", 1)[1]

    before = directory()
    assert before == directory()
    source = copied / "planner" / "_kernels" / "sight_kernels.py"
    source.write_text(source.read_text() + "\n")
    assert directory() != before


def test_read_only_packages_keep_machine_code_in_the_users_cache(copied, tmp_path):
    # no directory can be made there, whoever runs the test
    (copied / "planner" / "_kernels" / "__pycache__").write_text("")
    lines = run(STATE, copied, XDG_CACHE_HOME=str(tmp_path / "cache"), NUMBA_CACHE_DIR="")
    if sys.platform.startswith("linux"):
        assert lines[0].startswith(f"False {tmp_path / 'cache'}")


def test_without_any_cache_directory_kernels_are_compiled_for_the_run(copied, tmp_path):
    (copied / "planner" / "_kernels" / "__pycache__").write_text("")
    blocked = tmp_path / "file"
    blocked.write_text("")
    settings = {"XDG_CACHE_HOME": str(blocked), "LOCALAPPDATA": str(blocked), "HOME": str(blocked)}
    code = """
import numpy as np
from planner._kernels.tree_kernels import subtree_ranges
print(*subtree_ranges(np.array([-1, 0, 0]), np.array([0, 1, 2])))
from planner.warm_up import kernels_can_be_kept
from planner._kernels.compiled import kernel_is_cached
print(kernels_can_be_kept(), kernel_is_cached(subtree_ranges))
"""
    assert run(STATE, copied, NUMBA_CACHE_DIR=str(blocked), **settings)[0] == "False None"
    assert run(code, copied, NUMBA_CACHE_DIR=str(blocked), **settings) == [
        "[0 1 2] [0 1 2] [3 2 3]",
        "False True",
    ]


def test_old_machine_code_is_forgotten_but_for_the_newest(tmp_path):
    names = [f"metal-blossom-{k}" for k in range(compiled.KEPT_DIRECTORIES + 3)]
    for k, name in enumerate(names):
        (tmp_path / name).mkdir()
        os.utime(tmp_path / name, (k, k))
    (tmp_path / "other").mkdir()
    compiled._forget_old(tmp_path / names[0])
    kept = {names[0], *names[3:], "other"}
    assert {path.name for path in tmp_path.iterdir()} == kept
