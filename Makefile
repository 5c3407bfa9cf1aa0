# Everything runs from a clean clone: the first target that needs it makes the environment.
# Needed beforehand: Python 3.11 or later with its venv module, git and make.

SHELL := /bin/sh
.DEFAULT_GOAL := help
MAKEFLAGS += --no-print-directory

VENV := .venv
PY := $(VENV)/bin/python
# The first of these that is new enough makes the environment; `make setup PYTHON=...` names another.
PYTHON ?= python3 python3.13 python3.12 python3.11
UV ?= uv
JOBS ?= 2
ARGS ?=
MISSION ?= museum-1
MINUTES ?= 10

PIP := $(PY) -m pip --disable-pip-version-check --no-input
# What the environment was made from: another lock, another pyproject or a moved folder renews it.
CORE_FINGERPRINT = { pwd; cat requirements-core.lock pyproject.toml | cksum; }
CORE_STAMP := $(VENV)/.core-made-from
FINGERPRINT = { pwd; cat requirements.lock pyproject.toml | cksum; }
STAMP := $(VENV)/.made-from
BENCH_STAMP := $(VENV)/.bench-made-from

.PHONY: help core setup demo test fuzz check format format-check lint types contracts locks api docs notebooks examples bench lock clean claims

help:  ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1|\2/p' Makefile | awk -F'|' '{ printf "%-20s %s\n", $$1, $$2 }'

core:  ## make .venv with the pilotage command in it and nothing that only its developers need
	@set -e; \
	[ -x $(PY) ] && [ "$$(cat $(CORE_STAMP) 2>/dev/null)" = "$$($(CORE_FINGERPRINT))" ] && exit 0; \
	if ! $(PY) -m pip --version >/dev/null 2>&1 || \
	  { [ -f $(CORE_STAMP) ] && [ "$$(head -n 1 $(CORE_STAMP))" != "$$(pwd)" ]; }; then \
	  found=; old=; \
	  for candidate in $(PYTHON); do \
	    command -v "$$candidate" >/dev/null 2>&1 || continue; \
	    if "$$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; \
	    then found=$$candidate; break; else old="$$old, found $$("$$candidate" -V 2>&1)"; fi; \
	  done; \
	  [ -n "$$found" ] || { echo "make setup: needs Python 3.11 or later$$old; install one or name it by PYTHON=..." >&2; exit 2; }; \
	  "$$found" -c 'import venv, ensurepip' 2>/dev/null || { \
	    version=$$("$$found" -c 'import sys; print("%d.%d" % sys.version_info[:2])'); \
	    echo "make setup: $$found has no venv module; on Debian or Ubuntu: sudo apt install python$$version-venv" >&2; exit 2; }; \
	  echo "making .venv with $$("$$found" -V)"; \
	  "$$found" -m venv --clear $(VENV); \
	fi; \
	rm -f $(CORE_STAMP); \
	echo "installing the core's lock (about 180 MB to fetch the first time)"; \
	$(PIP) install --quiet --require-hashes -r requirements-core.lock; \
	$(PIP) install --quiet --no-deps --no-build-isolation --editable .; \
	$(CORE_FINGERPRINT) > $(CORE_STAMP); \
	echo "ready: $(VENV)/bin/pilotage"

setup: core  ## the same with all extras and the tools of tests, types and docs
	@set -e; \
	[ "$$(cat $(STAMP) 2>/dev/null)" = "$$($(FINGERPRINT))" ] && exit 0; \
	rm -f $(STAMP); \
	echo "installing the rest of the lock (about 350 MB to fetch the first time)"; \
	$(PIP) install --quiet --require-hashes -r requirements.lock; \
	$(FINGERPRINT) > $(STAMP)

demo: core  ## run the night watch and name the report to open
	@$(PY) -m pilotage run $(MISSION) $(ARGS)
	@echo "open the report named above in any browser; it needs no network"

test: setup  ## run the tests (ARGS="-k name" picks some, JOBS=4 takes more processes)
	@$(PY) -m pytest -n $(JOBS) --dist worksteal $(ARGS)

fuzz: setup  ## damaged inputs over all commands for ten minutes (MINUTES=60; guided by coverage with atheris)
	@PYTHONPATH=tests MPLBACKEND=Agg $(PY) -W error -m fuzz.long --minutes $(MINUTES) $(ARGS)

check: format-check lint types contracts locks test  ## all that CI runs (the examples are among the tests)

format: setup  ## format the code
	@$(PY) -m ruff format .
	@$(PY) -m ruff check --fix --select I .

format-check: setup
	@$(PY) -m ruff format --no-cache --check .

# Without its cache: kept answers outlived a new `__init__.py`, which changes what an import is.
lint: setup
	@$(PY) -m ruff check --no-cache .

types: setup
	@$(PY) -m mypy

contracts: setup
	@$(VENV)/bin/lint-imports --no-logo

# A lock names packages and hashes, never where they were fetched from.
locks:
	@! grep -nE '://|--(extra-)?index-url|--find-links' requirements-core.lock requirements.lock requirements-bench.lock

api: setup  ## write docs/api anew from the docstrings, docs/reports.md from its tables
	@$(PY) docs/make_api.py
	@$(PY) docs/make_reports.py

claims: setup  ## measure what README and docs claim, write docs/claims.json and their numbers (ARGS=NAME: one of docs/claims.yaml)
	@$(PY) docs/make_claims.py $(ARGS)

docs: setup  ## build the site into build/site: executes the notebooks, drives the gallery's missions; no network
	@$(PY) docs/make_site.py $(ARGS)

notebooks: setup  ## execute the five notebooks and stop at the first error
	@$(PY) docs/make_site.py --notebooks

examples: setup  ## run the examples alone
	@$(PY) -m pytest tests/unit/test_examples.py $(ARGS)

bench: setup  ## compare with the peers: installs them, prints a table of ratios
	@set -e; \
	if [ "$$(cat $(BENCH_STAMP) 2>/dev/null)" != "$$(cksum < requirements-bench.lock)" ]; then \
	  echo "installing the peers"; \
	  $(PIP) install --quiet --require-hashes -r requirements-bench.lock; \
	  cksum < requirements-bench.lock > $(BENCH_STAMP); \
	fi
	@missed=0; $(PY) -m benchmarks.peers $(ARGS) || missed=1; \
	for part in ekf_peer grid_peers pose_graphs slam_peers; do $(PY) -m benchmarks.$$part || missed=1; done; \
	exit $$missed

COMPILE = $(UV) pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --no-annotate

lock:  ## resolve the locks again (UPGRADE=--upgrade takes newer versions); needs uv
	@command -v $(UV) >/dev/null || { echo "make lock: needs uv; name it by UV=..." >&2; exit 2; }
	@$(COMPILE) $(UPGRADE) --extra dev --extra docs --extra vision --extra cluster --extra ros --extra rerun --extra gym pyproject.toml -o requirements.lock
	@echo hatchling | $(COMPILE) --constraint requirements.lock pyproject.toml - -o requirements-core.lock
	@$(COMPILE) $(UPGRADE) --extra bench --constraint requirements.lock pyproject.toml -o requirements-bench.lock
	@$(MAKE) locks

clean:  ## remove .venv and the tools' caches; runs/ and studies/ stay
	@rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build dist fuzz-found
	@find src tests examples benchmarks -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true
