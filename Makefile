# The project's two commands, and the steps that they consist of. Needs Python >= 3.11, git and make.
#
#   make demo    folds a shipped shape from mesh to replay on an emulated machine
#   make test    lint, types and all tests but the slow ones
#
# Both make .venv by themselves. Another interpreter: make PYTHON=python3.12 test

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:

VENV ?= .venv
WORKERS ?= 2
ifndef PYTHON
PYTHON := $(shell for p in python3 python3.14 python3.13 python3.12 python3.11 python; do \
  $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done; true)
endif

# Pictures are rendered without a screen; elsewhere MuJoCo finds its own way.
ifeq ($(shell uname -s),Linux)
export MUJOCO_GL ?= egl
endif

.PHONY: help demo test lint types tests slow format goals docs viewer wheel clean

help:
	@sed -n 's/^#  *\(make .*\)/\1/p' $(firstword $(MAKEFILE_LIST))

demo: $(VENV)/installed
	$(VENV)/bin/blossom demo -o out/demo

test: lint types tests

lint: $(VENV)/installed-test
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .

types: $(VENV)/installed-test
	$(VENV)/bin/mypy

tests: $(VENV)/installed-test
	$(VENV)/bin/pytest -n $(WORKERS) $(if $(ARTEFACTS),--artefacts $(ARTEFACTS))

# Takes minutes: builds wheel and sdist and runs the demo from each in an empty environment.
slow: $(VENV)/installed-test
	$(VENV)/bin/pytest -m slow

format: $(VENV)/installed-test
	$(VENV)/bin/ruff check --fix .
	$(VENV)/bin/ruff format .

goals: $(VENV)/installed
	$(VENV)/bin/python -m models.goals.make_goals

# The pages as a site in build/site; a warning is an error.
docs: $(VENV)/installed-test
	$(VENV)/bin/mkdocs build --quiet

# The 3-D view of the report, from its sources and the locked packages; needs Node and npm.
viewer:
	studio/viewer/build

wheel: $(VENV)/installed-test
	$(VENV)/bin/python -m build

clean:
	rm -rf build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache

$(VENV)/python-found:
	@test -n "$(PYTHON)" || { echo "Metal Blossom needs Python 3.11 or newer: install it, or name it: make PYTHON=/path/to/python3" >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/installed: pyproject.toml | $(VENV)/python-found
	$(VENV)/bin/pip install --quiet --editable .
	@touch $@

$(VENV)/installed-test: pyproject.toml | $(VENV)/python-found
	$(VENV)/bin/pip install --quiet --editable '.[test]'
	@touch $@ $(VENV)/installed
