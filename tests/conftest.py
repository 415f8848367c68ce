"""Options, fixtures and the hypothesis profiles that all tests share."""

from __future__ import annotations

import os
from pathlib import Path

import hypothesis
import pytest

REPOSITORY = Path(__file__).resolve().parent.parent

# "ci": the same examples every time. "desk": hypothesis keeps looking for new ones.
# Neither has a deadline, because no test may depend on timing.
hypothesis.settings.register_profile("ci", derandomize=True, deadline=None, database=None, print_blob=True)
hypothesis.settings.register_profile("desk", deadline=None)
hypothesis.settings.load_profile("ci" if os.environ.get("CI") else "desk")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that says where the common test meshes lie."""
    parser.addoption(
        "--shared-meshes",
        metavar="PATH",
        default=None,
        help="folder with the common test meshes (real, proc, bad, variants); default: ../shared/meshes",
    )
    parser.addoption(
        "--artefacts", metavar="PATH", default=None, help="folder for pictures that people look at"
    )


@pytest.fixture(scope="session")
def repository() -> Path:
    """Root folder of the checkout."""
    return REPOSITORY


@pytest.fixture(scope="session")
def artefacts(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder for pictures that people look at: given by --artefacts, else one of the test run."""
    given = request.config.getoption("--artefacts")
    if not given:
        return tmp_path_factory.mktemp("artefacts")
    folder = Path(given)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def shared_meshes(request: pytest.FixtureRequest) -> Path:
    """Folder with the common test meshes: given by --shared-meshes, else beside the checkout.

    Tests that need it are skipped only where the folder is absent; a folder that was named must be there.
    """
    given = request.config.getoption("--shared-meshes")
    folder = Path(given) if given else REPOSITORY.parent / "shared" / "meshes"
    if folder.is_dir():
        return folder.resolve()
    if given:
        raise pytest.UsageError(f"--shared-meshes {given}: no such folder")
    pytest.skip(f"the common test meshes are not there: {folder}")
