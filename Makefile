# Slewline: one command for everything. `make demo` and `make test` do their own set-up.

PYTHON ?= python3
UV ?= uv
BIN := .venv/bin
PRODUCT := .venv/.product
TOOLS := .venv/.tools
WARM := .venv/.warm
REWRITTEN := .venv/.rewritten
KERNELS := $(shell grep -rlE '^@(kernel|inner|borrowing|borrowing_inner|inlined|templated|unbox)' planner_core --include=*.py)
# How they are called is part of what is compiled.
KERNELS += planner_core/bundles.py planner_core/jit.py planner_core/kernel_cache.py
LOCK := $(UV) pip compile --universal --python-version 3.11 --generate-hashes \
	--no-emit-index-url
PIP := $(BIN)/python -m pip -qq --disable-pip-version-check

# Where it is set each of the hundred processes of a run would compile every module anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup demo serve test explore chaos fuzz flight browser screenshots check \
	check-types check-rest format lock dist paper paper-quick clean

help:
	@echo "make demo     plan a real-size mission through the service's own API, and end"
	@echo "make serve    the same, and keep serving"
	@echo "make test     every check and every test; with SLEWLINE_TEST_PROFILE=full"
	@echo "              also runs of real size, and five times the examples"
	@echo "make explore  the property tests with new examples"
	@echo "make chaos    500 jobs while processes are killed and databases fail (needs Debian and root)"
	@echo "make fuzz     files made by coverage-guided fuzzing, against every parser (Linux)"
	@echo "make flight   two hours of plans flown in Basilisk (0.6 GB to install)"
	@echo "make browser  the dashboard in a real browser (needs Chromium, or Debian and root)"
	@echo "make screenshots  the pictures of the dashboard in docs/images (likewise)"
	@echo "make check    lint, format, types, import contracts, examples in docstrings"
	@echo "make setup    the environment in .venv (the others call it)"
	@echo "make format   rewrite the sources in the one layout"
	@echo "make dist     an sdist and a wheel, in dist"
	@echo "make lock     resolve the dependencies again into the lock files (needs uv)"
	@echo "make paper    the paper's study again, within two hours; writes docs/paper-reproduction.md"
	@echo "make paper-quick  the same in five minutes, into build/paper-quick"
	@echo "make clean    remove all that these commands made"

setup: $(TOOLS) $(WARM)
	@:

# Everything pip fetches is checked against a hash; the build of the project itself fetches nothing.
$(PRODUCT): pyproject.toml requirements.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
		echo "Slewline needs Python 3.11 or later, and '$(PYTHON)' is not. Try: make PYTHON=python3.12" >&2; \
		exit 1; }
	@echo "Setting up .venv (once; about half a minute) ..."
	@$(PYTHON) -m venv .venv
	@$(PIP) install --no-compile --require-hashes -r requirements.lock
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@touch $@

# What only developers need, on top of the product.
$(TOOLS): $(PRODUCT) requirements-dev.lock
	@echo "Adding the developers' tools (once) ..."
	@$(PIP) install --no-compile --require-hashes -r requirements-dev.lock
	@touch $@

# An edited kernel is compiled here, once, and not by each worker on its own.
$(WARM): $(PRODUCT) $(KERNELS)
	@$(BIN)/python -m service.jobs.warm
	@touch $@

# pytest rewrites the asserts of all modules and keeps what came out: in a fresh clone each of its
# processes would do so, all at once.
$(REWRITTEN): $(TOOLS)
	@$(BIN)/python -m pytest --collect-only --quiet > $@.log || { cat $@.log; exit 1; }
	@mv $@.log $@

# The demonstration compiles what it needs itself, and no more.
demo: $(PRODUCT)
	@$(BIN)/slewline demo

serve: $(PRODUCT)
	@$(BIN)/slewline demo --serve

# Two processes for each core, each with a module at a time; see docs/testing.md.
test: check
	$(BIN)/python -m pytest -n auto --durations=25 $(if $(filter full,$(SLEWLINE_TEST_PROFILE)),-m "")

# The property tests with new examples, all that each asks for.
explore: setup
	SLEWLINE_TEST_PROFILE=explore $(BIN)/python -m pytest -n auto -m hypothesis

# On a SQLite file, then on a PostgreSQL server that is killed as well.
chaos: export SLEWLINE_TEST_CHAOS_JOBS ?= 500
chaos: setup
	$(BIN)/python -m pytest tests/service/jobs/chaos
	.ci/postgresql $(BIN)/python -m pytest tests/service/jobs/chaos

# The fuzzer has wheels for Linux alone, so it is no dependency of the project.
fuzz: setup
	@$(PIP) install --require-hashes -r tests/fuzz/requirements.lock
	$(BIN)/python -m tests.fuzz.guided

# Basilisk wants versions of its own, and so an environment of its own.
flight: setup
	@$(PYTHON) -m venv build/flight
	@build/flight/bin/python -m pip -qq --disable-pip-version-check install --no-compile \
		--require-hashes -r benchmarks/flight/requirements.lock
	SLEWLINE_TEST_FLIGHT_PYTHON=build/flight/bin/python $(BIN)/python -m pytest tests/flight

browser: setup
	.ci/browser $(BIN)/python -m pytest tests/service/dashboard/browser

screenshots: setup
	.ci/browser $(BIN)/python -m tests.service.dashboard.browser.screenshots

# mypy takes one core for half a minute, all else the other one. To import what a fork server loads
# would load all kernels here.
check: setup
	@$(MAKE) --no-print-directory --jobs=2 check-types check-rest

check-types:
	$(BIN)/mypy

check-rest: $(REWRITTEN)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/python -m pytest --quiet --doctest-modules slewline planner_core service \
		--ignore=service/jobs/preload.py

format: setup
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

lock:
	$(LOCK) pyproject.toml --extra otel --extra build -o requirements.lock
	$(LOCK) pyproject.toml --extra otel --extra build --extra dev --extra study -c requirements.lock \
		-o requirements-dev.lock
	$(LOCK) benchmarks/flight/requirements.in -o benchmarks/flight/requirements.lock
	$(LOCK) tests/fuzz/requirements.in -o tests/fuzz/requirements.lock

dist: $(TOOLS)
	@$(BIN)/python -m build --no-isolation

# Both go on where they were stopped.
paper: setup
	@$(BIN)/python -m benchmarks.paper

paper-quick: setup
	@$(BIN)/python -m benchmarks.paper --quick

clean:
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	rm -rf build dist demo-output *.egg-info
	find slewline planner_core service tests migrations benchmarks -name __pycache__ -prune -exec rm -rf {} +
