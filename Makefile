# `make demo` and `make test` do all their own set-up: nothing but Python (>= 3.11) and pip is needed.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
OUT ?= out/demo
PYTEST_ARGS ?=

# One thread per maths library: the workers and the physics own the cores.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
export MKL_NUM_THREADS ?= 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.DEFAULT_GOAL := help
.PHONY: help demo test lint bench clean

help:  ## List the targets
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## / \t/'

$(BIN)/python:
	@echo "==> Making a virtual environment in $(VENV)"
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "omni_envs needs Python 3.11 or newer; set PYTHON=")'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.demo: pyproject.toml constraints.txt | $(BIN)/python
	@echo "==> Installing omni_envs and what training, export and video need"
	$(BIN)/python -m pip install -c constraints.txt -e '.[sb3,export,viewer]'
	@touch $@

$(VENV)/.test: $(VENV)/.demo
	@echo "==> Installing the test tools"
	$(BIN)/python -m pip install -c constraints.txt -e '.[placo,torchrl,dev]'
	@touch $@

demo: $(VENV)/.demo  ## Demonstration → reference → policy → ONNX → video, in under 10 minutes
	$(BIN)/omni-envs demo --out $(OUT)

lint: $(VENV)/.test  ## Ruff (lint, format) and the type checker
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

test: lint  ## Lint, type check and the whole test suite
	$(BIN)/python -m pytest -n 2 $(PYTEST_ARGS)

bench: $(VENV)/.demo  ## Speed of retargeting and of the environment
	$(BIN)/omni-envs bench retarget box_carry
	$(BIN)/omni-envs bench step

clean:  ## Remove the virtual environment and build output
	rm -rf $(VENV) build dist out *.egg-info .pytest_cache .mypy_cache .ruff_cache
