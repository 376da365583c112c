# make demo | test | quick | coverage | coverage-own | docs | figures | real | package | archives | reference | lock
SHELL := /bin/bash
PYTHON ?= $(shell /usr/bin/python3 -c 'import sys; print("/usr/bin/python3" if sys.version_info >= (3, 11) else "python3")' 2>/dev/null || echo python3)
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --quiet --disable-pip-version-check
export NO_MKDOCS_2_WARNING := 1
export NUMBA_CACHE_DIR := $(CURDIR)/$(VENV)/numba
# a source file is compiled once, not by each of the processes that the tests start
unexport PYTHONDONTWRITEBYTECODE

.PHONY: setup test quick coverage coverage-own docs figures real package archives demo reference lock
.DELETE_ON_ERROR:

# what runs jobs and shows the page
$(VENV)/.run: requirements-run.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "chipload needs Python 3.11 or newer")'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(PIP) install --require-hashes -r requirements-run.lock
	$(PIP) install --no-build-isolation --no-deps -e .
	touch $@

# and what tests and documentation need
setup: $(VENV)/.ready

$(VENV)/.ready: $(VENV)/.run requirements.lock
	$(PIP) install --require-hashes -r requirements.lock
	touch $@

CHECKED := $(VENV)/checked.log
COLLECTED := $(VENV)/collected.log
# files that may call what only one system has; their types are checked for the other systems too, in seconds
CALLERS = $$(grep -rlE '^\s*(import|from) (asyncio|ctypes|errno|fcntl|mmap|msvcrt|multiprocessing|os|pty|resource|select|selectors|signal|socket|stat|subprocess|sys|termios|threading|time)\b' src/chipload)
FOREIGN = $(BIN)/mypy --config-file tools/platform_types.ini --cache-dir .mypy_cache/foreign

# the slow checks beside the tests, so that no core waits; what they say stands at the end. The tests are collected once
# before their workers start: that compiles what is compiled when it is imported, kernels whose types are stated and the
# assertions of the tests. Each worker would do it again
test: setup
	$(BIN)/ruff check . && $(BIN)/ruff format --check .
	{ $(BIN)/mypy && $(FOREIGN) --platform win32 $(CALLERS) && $(FOREIGN) --platform darwin $(CALLERS) \
	  && $(BIN)/lint-imports && $(BIN)/mkdocs build --strict --quiet --site-dir $(VENV)/site; } \
	  > $(CHECKED) 2>&1 & checks=$$!; \
	{ $(BIN)/pytest -p no:xdist --collect-only -qq > $(COLLECTED) 2>&1 || { cat $(COLLECTED); false; }; } \
	&& OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2 --dist worksteal -ra --durations=60 --durations-min=5; tested=$$?; \
	wait $$checks; checked=$$?; cat $(CHECKED); \
	exit $$((tested ? tested : checked))

# the tests marked core, within 3 minutes on two cores
quick: setup
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2 --dist worksteal -q -m core tests

# which share of each package the tests run; about twice the time of the tests
coverage: setup
	rm -f .coverage .coverage.*
	OPENBLAS_NUM_THREADS=1 $(BIN)/coverage run -m pytest -n 2 --dist worksteal -q
	$(BIN)/python tools/coverage_by_package.py

# which share of each package its own tests run, written to docs/reliability.md
coverage-own: setup
	$(BIN)/python tools/coverage_by_package.py --own --write

docs: setup
	$(BIN)/mkdocs build --strict --site-dir site

# every number, console output and picture that the pages show of the examples, from their results: about 15 minutes;
# FIGURES="plate --results result" names examples and keeps their results. Look at what changed
figures: setup
	$(BIN)/python tools/figures.py $(FIGURES)

# the tests that take minutes, and every real file of docs/real_programs.md, run whole; CHIPLOAD_DATA is their folder.
# Hours: for the night
real: setup
	CHIPLOAD_LONG=1 OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -q tests/real tests/results/test_page_values.py
	$(BIN)/python tools/real_programs.py

# the wheel and the source archive; the wheel runs a job in an environment of its own, away from the checkout
package: setup
	$(BIN)/python tools/package.py

# the same with the dependencies of .venv: no network, a quarter of a minute
archives: setup
	$(BIN)/python tools/package.py --here --out $(VENV)/dist

# the second core compiles for the third example while the first runs
# 0: every limit holds; 3: done, but a limit does not hold, which the verdict says; anything else is a fault
demo: $(VENV)/.run
	@mkdir -p result; \
	job() { code=0; $(BIN)/chipload run examples/$$1/job.toml --out result/$$1 || code=$$?; [ $$code -eq 0 ] || [ $$code -eq 3 ]; }; \
	job chips > result/chips.log 2>&1 & chips=$$!; \
	job contour && job pocket; planned=$$?; \
	wait $$chips; simulated=$$?; cat result/chips.log; rm result/chips.log; \
	echo "the page: $(BIN)/chipload view result"; \
	exit $$((planned + simulated))

# docs/summary.schema.json, columns.md, jobs.md and materials.md, from the source
reference: setup
	$(BIN)/python tools/docs_reference.py

# needs uv on the path or in .venv, nothing else here does
UV ?= $(shell command -v uv || echo $(BIN)/uv)
COMPILE = $(UV) pip compile --universal --python-version 3.11 --generate-hashes --no-header --no-annotate --no-emit-index-url --quiet
lock:
	$(COMPILE) --extra dev --output-file requirements.lock pyproject.toml
	$(COMPILE) --extra build --extra web --constraint requirements.lock --output-file requirements-run.lock pyproject.toml
