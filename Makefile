# make setup | test | demo | reference | lock
SHELL := /bin/bash
PYTHON ?= $(shell /usr/bin/python3 -c 'import sys; print("/usr/bin/python3" if sys.version_info >= (3, 11) else "python3")' 2>/dev/null || echo python3)
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.ready
export NUMBA_CACHE_DIR := $(CURDIR)/$(VENV)/numba

.PHONY: setup test demo reference lock
.DELETE_ON_ERROR:

setup: $(STAMP)

$(STAMP): requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "chipload needs Python 3.11 or newer")'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps -e .
	touch $(STAMP)

test: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2 --dist worksteal -ra

# 0: every limit holds; 3: done, but a limit does not hold, which the verdict says; anything else is a fault
demo: setup
	@for name in contour pocket chips; do \
	  code=0; $(BIN)/chipload run examples/$$name/job.toml --out result/$$name || code=$$?; \
	  if [ $$code -ne 0 ] && [ $$code -ne 3 ]; then exit $$code; fi; \
	done

# docs/summary.schema.json, docs/columns.md and docs/jobs.md, from the source
reference: setup
	$(BIN)/python tools/docs_reference.py

# needs uv on the path or in .venv, nothing else here does
UV ?= $(shell command -v uv || echo $(BIN)/uv)
lock:
	$(UV) pip compile --universal --python-version 3.11 --generate-hashes --no-header --no-annotate \
	  --no-emit-index-url --extra dev --quiet --output-file requirements.lock pyproject.toml
