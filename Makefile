# `make` alone lists the targets: a line of two hashes above a target is its help.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
OTHER_PYTHON ?= $(shell for python in python3.13 python3.12 "$$HOME"/.pyenv/versions/3.13*/bin/python; do \
  "$$python" -c '' 2> /dev/null && echo "$$python" && break; done)
CORES ?= $(shell nproc)
OTHER_TESTS ?= tests
STUDY ?= config/studies/tube_demo.yaml
MINUTES ?= 60
BIN := .venv/bin
INSTALLED := .venv/installed

TWINS := engine_twins rolling_axes

LINT := lint-style lint-types lint-imports lint-rules lint-names

.DEFAULT_GOAL := help
.PHONY: help install demo study plan status report quick fast-tests test all-tests other-python lint $(LINT) architecture decks schema lock lock-check results results-check results-pages docs clean
.PHONY: twins verification stability rebound size-ratio lammps-decks at-rest core-loop size reliability fuzz benchmarks peers scaling solidification flow \
  reproduction speed-accuracy

help:
	@echo 'make TARGET [STUDY=config/studies/tube_frequency.yaml] [CORES=2]'
	@awk '/^## / {help = substr($$0, 4); next} \
	  help && /^[a-z-]+:/ {sub(/:.*/, "", $$1); printf "  %-14s %s\n", $$1, help} {help = ""}' \
	  $(firstword $(MAKEFILE_LIST))
	@echo 'The command itself: $(BIN)/sandmould --help'

## install the command into .venv and do nothing else
install: $(INSTALLED)
	@echo 'The command: $(BIN)/sandmould --help. A first try: $(BIN)/sandmould demo --quick'

## the main job on real input: sand flows into a tube at four frequencies
demo: $(INSTALLED)
	@$(MAKE) --no-print-directory study

## compute STUDY, or what is missing of it, and write its report
study: $(INSTALLED)
	@$(BIN)/sandmould run $(STUDY) --cores $(CORES)

## check STUDY and print its runs and their price; nothing starts
plan: $(INSTALLED)
	@$(BIN)/sandmould plan $(STUDY) --cores $(CORES)

## where STUDY stands and what is left of it
status: $(INSTALLED)
	@$(BIN)/sandmould status $(STUDY) --cores $(CORES)

## write the report of STUDY again from its results
report: $(INSTALLED)
	@$(BIN)/sandmould report $(STUDY)

## lint, types, import contract and the fast half of the tests, in two minutes on two cores
quick: $(INSTALLED)
	@$(MAKE) --no-print-directory -j 2 --output-sync=target lint fast-tests

## lint, types, import contract and all tests
test: $(INSTALLED)
	@$(MAKE) --no-print-directory -j 2 --output-sync=target lint
	@$(MAKE) --no-print-directory all-tests

all-tests: $(INSTALLED)
	$(BIN)/pytest -n 2 --dist loadfile --no-loadscope-reorder

fast-tests: $(INSTALLED)
	$(BIN)/pytest -n 2 --dist loadfile --no-loadscope-reorder -m "not slow and not browser"

## the fast half of OTHER_TESTS on another supported Python, where there is one
other-python:
ifeq ($(OTHER_PYTHON),)
	@echo 'No other Python from 3.12 on is found: the tests ran on one alone.'
else
	$(OTHER_PYTHON) -m venv .venv-other
	.venv-other/bin/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	.venv-other/bin/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	.venv-other/bin/pytest -n 2 --dist loadfile --no-loadscope-reorder -m "not slow and not browser" $(OTHER_TESTS)
endif

## lint, types and import contract alone
lint: $(LINT)

lint-style: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

lint-types: $(INSTALLED)
	$(BIN)/mypy

lint-imports: $(INSTALLED)
	$(BIN)/lint-imports

lint-rules: $(INSTALLED)
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/snakemake --lint

lint-names: $(INSTALLED)
	$(BIN)/python -m benchmarks.house.names

## the engines compared: docs/engine_twins.md
twins: $(INSTALLED)
	@for name in $(TWINS); do \
	  $(MAKE) --no-print-directory study STUDY=config/studies/$$name.yaml \
	    && $(BIN)/python -m sandmould.execution.records record config/studies/$$name.yaml || exit 1; \
	done
	@$(BIN)/python -m benchmarks.agreement

## exact cases on all engines: docs/verification.md
verification: $(INSTALLED)
	$(BIN)/python -m tests.verification.table

## where each engine becomes unstable: docs/stability.md
stability: $(INSTALLED)
	@$(BIN)/python -m benchmarks.stability

## what LAMMPS decks cost with near grains and sorting: docs/developers/lammps_speed.md
lammps-decks: $(INSTALLED)
	@$(BIN)/python -m benchmarks.lammps_decks $(QUICK)

## impacts on all engines and beds with both dashpots: docs/developers/rebound.md
rebound: $(INSTALLED)
	@$(BIN)/python -m benchmarks.rebound $(QUICK)

## small grains between large ones: docs/developers/size_ratio.md
size-ratio: $(INSTALLED)
	@$(BIN)/python -m benchmarks.size_ratio $(QUICK)

## packing measured at speed and at rest: docs/developers/measured_at_rest.md
at-rest: $(INSTALLED)
	@NUMBA_NUM_THREADS=1 $(BIN)/python -m benchmarks.at_rest $(QUICK)

## studies killed, disks that fail: docs/developers/reliability.md, 50 minutes
reliability: $(INSTALLED)
	@$(BIN)/python -m benchmarks.reliability $(QUICK)

## damaged files for every reader, MINUTES long
fuzz: $(INSTALLED)
	@$(BIN)/python -m tests.fuzz.campaign --minutes $(MINUTES)

## error over core time of every method, from committed results: docs/speed_and_accuracy.md
speed-accuracy: $(INSTALLED)
	@$(BIN)/python -m benchmarks.speed_and_accuracy

## how fast the engines are: docs/developers/speed.md
benchmarks: $(INSTALLED)
	@$(BIN)/python -m benchmarks.engines $(QUICK)

## the solver's step loop beside an earlier commit: docs/developers/core_loop.md
core-loop: $(INSTALLED)
	@$(BIN)/python -m benchmarks.core_loop $(QUICK)

## memory, listings, meshes and large beds beside an earlier commit: docs/developers/size.md
size: $(INSTALLED)
	@$(BIN)/python -m benchmarks.size $(QUICK)

# The peers need an older numpy, so they have an environment of their own.
## calibration beside other tools: docs/developers/calibration_peers.md
peers: $(INSTALLED) .venv-peers/installed
	@$(BIN)/python -m benchmarks.calibration $(QUICK)

## what the workflow costs up to 10 000 runs: docs/developers/workflow_cost.md
scaling: $(INSTALLED) .venv-peers/installed
	@$(BIN)/python -m benchmarks.scaling $(QUICK)

.venv-peers/installed: benchmarks/peers/requirements.txt
	$(PYTHON) -m venv .venv-peers
	.venv-peers/bin/pip install --quiet --disable-pip-version-check --requirement $<
	touch $@

.venv-peers-flow/installed: benchmarks/peers/requirements_flow.txt
	$(PYTHON) -m venv .venv-peers-flow
	.venv-peers-flow/bin/pip install --quiet --disable-pip-version-check --requirement $<
	touch $@

## metal flow: docs/metal_flow.md
flow: $(INSTALLED) .venv-peers-flow/installed
	@NUMBA_NUM_THREADS=1 $(BIN)/python -m benchmarks.mps $(QUICK)

# Compiled loops of one thread wait for no other.
## solidification: docs/solidification.md
solidification: $(INSTALLED)
	@NUMBA_NUM_THREADS=1 $(BIN)/python -m benchmarks.arpm $(QUICK)

## the documentation as a site in site/, strictly: links and anchors are checked
docs: $(INSTALLED)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

## draw the rooms and write docs/developers/architecture.md
architecture: $(INSTALLED)
	@$(BIN)/python -m benchmarks.house.architecture

## what the papers claim beside the committed results: docs/reproduction.md
reproduction: $(INSTALLED)
	@$(BIN)/python -m benchmarks.reproduction

## render the golden decks again
decks: $(INSTALLED)
	$(BIN)/pytest tests/decks --refresh-golden

## config/schema.json, config/default.yaml and docs/{measures,limits,keys,files,commands}.md from the types
schema: $(INSTALLED)
	$(BIN)/python -m sandmould.reference.schema
	$(BIN)/python -m sandmould.cli.reference

## pin all dependencies in requirements.lock, for every Python and platform that is supported
lock:
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --extra dev --extra docs --generate-hashes --no-strip-markers \
	  --no-header --output-file requirements.lock pyproject.toml

## look for wheels of all locked packages for the newest supported Python
lock-check: $(INSTALLED)
	@$(BIN)/python -m benchmarks.house.newest_python

## list stale results of docs/results and compute the smallest again
results-check: $(INSTALLED)
	$(BIN)/python -m sandmould.execution.records check

## compute all stale results of docs/results again, the cheapest first; goes on where it stopped
results: $(INSTALLED)
	$(BIN)/python -m sandmould.execution.records renew

## the page of each committed result, and their list docs/results/README.md
results-pages: $(INSTALLED)
	$(BIN)/python -m benchmarks.house.record_pages

## remove results
clean:
	rm -rf results .snakemake

$(INSTALLED): requirements.lock pyproject.toml
	@echo 'Installing into .venv: 1.4 GB, two minutes or more.'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@
