# make demo   the main job on real input: sand flows into a tube at six frequencies
# make test   lint, types, import contract and all tests
# The rest: make study STUDY=config/studies/tube_frequency.yaml, plan, status, decks, schema, lock,
# twins (the engines compared, docs/engine_twins.md), verification (docs/verification.md),
# stability (docs/stability.md), benchmarks (docs/speed.md), peers (docs/calibration_peers.md),
# scaling (docs/scaling.md), solidification (docs/solidification.md), flow (docs/metal_flow.md),
# results-check, clean.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
CORES ?= $(shell nproc)
STUDY ?= config/studies/tube_demo.yaml
BIN := .venv/bin
INSTALLED := .venv/installed

TWINS := engine_twins damping_forms contact_readings rolling_axes frames

.PHONY: demo study plan status twins verification stability test lint decks schema lock results-check clean benchmarks peers scaling solidification flow

demo: $(INSTALLED)
	@$(MAKE) --no-print-directory study

study: $(INSTALLED)
	@$(BIN)/python -m sandmould.study.run_study $(STUDY) --cores $(CORES) --quiet rules host

plan: $(INSTALLED)
	@$(BIN)/python -m sandmould.study.build_plan $(STUDY)

status: $(INSTALLED)
	@$(BIN)/python -m sandmould.study.status $(STUDY)

twins: $(INSTALLED)
	@for name in $(TWINS); do \
	  $(MAKE) --no-print-directory study STUDY=config/studies/$$name.yaml \
	    && $(BIN)/python -m sandmould.study.records record config/studies/$$name.yaml || exit 1; \
	done
	@$(BIN)/python -m benchmarks.agreement

verification: $(INSTALLED)
	$(BIN)/python -m tests.verification.table

stability: $(INSTALLED)
	@$(BIN)/python -m benchmarks.stability

benchmarks: $(INSTALLED)
	@$(BIN)/python -m benchmarks.engines $(QUICK)

# The peers need an older numpy, so they have an environment of their own.
peers: $(INSTALLED) .venv-peers/installed
	@$(BIN)/python -m benchmarks.calibration $(QUICK)

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

flow: $(INSTALLED) .venv-peers-flow/installed
	@NUMBA_NUM_THREADS=1 $(BIN)/python -m benchmarks.mps $(QUICK)

# Compiled loops of one thread wait for no other.
solidification: $(INSTALLED)
	@NUMBA_NUM_THREADS=1 $(BIN)/python -m benchmarks.arpm $(QUICK)

test: lint
	$(BIN)/pytest -n 2 --dist loadfile

lint: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/snakemake --lint

decks: $(INSTALLED)
	$(BIN)/pytest tests/decks --refresh-golden

schema: $(INSTALLED)
	$(BIN)/python -m sandmould.study.schema

lock:
	$(BIN)/pip-compile --quiet --extra dev --generate-hashes --allow-unsafe --strip-extras \
	  --no-emit-index-url --no-emit-trusted-host --no-emit-find-links --no-header \
	  --output-file requirements.lock pyproject.toml

results-check: $(INSTALLED)
	$(BIN)/python -m sandmould.study.records check

clean:
	rm -rf results .snakemake

$(INSTALLED): requirements.lock pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@
