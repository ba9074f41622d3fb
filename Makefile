# frictionlab: `make` runs the main job on sample_data, `make test` the tests, `make help` lists the rest.
#
# Your own logs:  make LOGS=folder SCENE=scene.toml OUT=folder   (without SCENE: a frictionlab.toml here or in LOGS;
# never the scene of sample_data, which is of another rig)
#
# One log, one recording, one measurement, one comparison with its figure: touch one log and that chain alone is redone.
# `frictionlab batch` does it, so Windows needs no make: frictionlab batch my_logs --scene my_scene.toml -o my_results

LOGS  ?= sample_data
SCENE ?=
OUT   ?= build

CAMPAIGN       ?= build/campaign
CAMPAIGN_SCENE ?= configs/campaign.toml
CAMPAIGN_LOGS  ?= $(CAMPAIGN)/logs
LAW            ?=

PYTHON ?= $(firstword $(foreach p,python3 python3.14 python3.13 python3.12 python3.11,$(shell \
	$(p) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $(p))))
BIN := .venv/bin
FRICTIONLAB := $(BIN)/frictionlab

export N SEED LOGS SCENE OUT CAMPAIGN CAMPAIGN_SCENE CAMPAIGN_LOGS LAW
# The recipes read these from the environment, between quotes: a folder's name may hold anything, and no log's name comes
# into a shell at all. `frictionlab batch` knows what changed and goes on when a log fails.
WORKERS = $(patsubst -j%,--workers=%,$(filter-out -j,$(filter -j%,$(MAKEFLAGS))))

.DEFAULT_GOAL := all
.PHONY: all campaign chapter3 help sample-data tradeoff test test-fast fuzz adversary check format clean

all: $(FRICTIONLAB)  ## ingest, analyze and compare all logs, then print the table (the default)
	@case "$$LOGS" in sample_data|sample_data/|./sample_data|./sample_data/) own=configs/sample_data.toml;; *) own=;; esac; \
	if test -n "$$SCENE"; then set -- --scene "$$SCENE"; \
	elif test -e frictionlab.toml || test -e "$$LOGS/frictionlab.toml" || test -z "$$own"; then set --; \
	else set -- --scene "$$own"; fi; \
	$(FRICTIONLAB) batch "$$@" -o "$$OUT" $(WORKERS) -- "$$LOGS"

# A whole campaign: only logs that are new or changed are ingested and measured again. LAW=auto: the contact law that each
# material requires, from the recordings of all its tests.

campaign: $(FRICTIONLAB)  ## a whole campaign up to its report: the virtual one, or CAMPAIGN_LOGS=folder CAMPAIGN_SCENE=scene.toml; LAW=auto finds each material's law
	@test "$$CAMPAIGN_LOGS" != "$$CAMPAIGN/logs" || test "$$CAMPAIGN/logs/truth.jsonl" -nt "$$CAMPAIGN_SCENE" || \
		$(FRICTIONLAB) synthesize --scene "$$CAMPAIGN_SCENE" -o "$$CAMPAIGN/logs"
	@$(FRICTIONLAB) batch --campaign --scene "$$CAMPAIGN_SCENE" -o "$$CAMPAIGN" $${LAW:+--law "$$LAW"} $(WORKERS) \
		-- "$$CAMPAIGN_LOGS"

sample-data: $(FRICTIONLAB)  ## make sample_data again, bit for bit, from configs/sample_data.toml
	$(FRICTIONLAB) synthesize --scene configs/sample_data.toml -o sample_data
	$(FRICTIONLAB) batch sample_data/steel_N1.25_r0.3.csv --scene configs/sample_data.toml -o build
	cp build/figures/steel_N1.25_r0.3.comparison.png sample_data/

chapter3: $(FRICTIONLAB)  ## redraw the thesis's chapter 3 from exact steady states, into $(OUT)/chapter3
	$(BIN)/python -m tests.benchmarks.chapter3 "$$OUT/chapter3"

tradeoff: $(FRICTIONLAB)  ## measure error and time of every accuracy knob on this machine
	$(FRICTIONLAB) tradeoff -o "$$OUT/tradeoff"

test: .venv/.test  ## install what is needed to test, then run the tests (house and documents are held by make check)
	$(BIN)/python -m pytest --ignore tests/test_house.py --ignore tests/test_docs.py

test-fast: .venv/.test  ## what to run at each change: the tests of each part that take moments, in under 45 s
	$(BIN)/python -m pytest -q -m fast tests

adversary: .venv/.test  ## recordings drawn to mislead the identification, judged by their truth: N=300 SEED=7
	$(BIN)/python -m tests.benchmarks.adversary --count "$${N:-300}" --seed "$${SEED:-7}"

fuzz: .venv/.test  ## read damaged files (100,000 logs, 20,000 of every other kind) and kill commands: no traceback, no hang, no half a file (more than an hour on two cores)
	$(BIN)/python -m tests.armour.fuzz --kinds log.text --count 100000
	$(BIN)/python -m tests.armour.fuzz --count 20000
	$(BIN)/python -m tests.benchmarks.kills

check: .venv/.test  ## lint, format, types, import rules, docs in step
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m tests.weigh
	$(BIN)/python -m pytest -q -n 0 tests/test_house.py tests/test_docs.py

format: .venv/.test  ## format the code and mend what the linter can
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:  ## remove what was built (the environment in .venv stays)
	rm -rf build

help:  ## list these targets
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / { printf "make %-12s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

$(FRICTIONLAB): pyproject.toml
	@test -n "$(PYTHON)" || { echo "make: no Python >= 3.11 found: install one, or give PYTHON=/path/to/python3" >&2; exit 2; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

.venv/.test: $(FRICTIONLAB)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@
