# frictionlab: `make` runs the main job on sample_data, `make test` the tests, `make help` lists the rest.
#
# Your own logs:  make LOGS=folder SCENE=scene.toml OUT=folder
#
# One log, one recording, one measurement, one comparison with its figure: touch one log and that chain alone is redone.

LOGS  ?= sample_data
SCENE ?= configs/sample_data.toml
OUT   ?= build

PYTHON ?= $(firstword $(foreach p,python3 python3.14 python3.13 python3.12 python3.11,$(shell \
	$(p) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $(p))))
BIN := .venv/bin
FRICTIONLAB := $(BIN)/frictionlab

EXTENSIONS := csv txt tsv asc dat lvm csv.gz txt.gz
logs  := $(sort $(foreach e,$(EXTENSIONS),$(wildcard $(LOGS)/*.$(e))))
names := $(sort $(foreach e,$(EXTENSIONS),$(patsubst $(LOGS)/%.$(e),%,$(filter %.$(e),$(logs)))))
recordings   := $(names:%=$(OUT)/recordings/%.h5)
measurements := $(names:%=$(OUT)/measurements/%.jsonl)
comparisons  := $(names:%=$(OUT)/comparisons/%.jsonl)

.DEFAULT_GOAL := all
.DELETE_ON_ERROR:
.PHONY: all chain help sample-data test check format clean

all: $(FRICTIONLAB)  ## ingest, analyze and compare all logs, then print the table (the default)
	@test -n "$(logs)" || { echo "make: no logs in $(LOGS): expected *.csv (or $(EXTENSIONS)); give LOGS=folder" >&2; exit 2; }
	@status=0; $(MAKE) --no-print-directory --keep-going chain || status=1; \
	cat $(OUT)/comparisons/*.jsonl > $(OUT)/comparisons.jsonl && $(FRICTIONLAB) show $(OUT)/comparisons.jsonl; \
	echo "recordings, measurements, comparisons and figures are in $(OUT)/"; exit $$status

chain: $(measurements) $(comparisons)

define ingest_rule
$(OUT)/recordings/%.h5: $(LOGS)/%.$(1) $(SCENE) | $(FRICTIONLAB) $(OUT)/recordings
	$(FRICTIONLAB) ingest $$< --scene $(SCENE) -o $$@ --quiet
endef
$(foreach e,$(EXTENSIONS),$(eval $(call ingest_rule,$(e))))

$(OUT)/measurements/%.jsonl: $(OUT)/recordings/%.h5 $(SCENE) | $(OUT)/measurements $(OUT)/figures
	$(FRICTIONLAB) analyze $< --scene $(SCENE) -o $@ --plot $(OUT)/figures --quiet

$(OUT)/comparisons/%.jsonl: $(OUT)/recordings/%.h5 $(SCENE) | $(OUT)/comparisons $(OUT)/figures
	$(FRICTIONLAB) compare-numeric $< --scene $(SCENE) -o $@ --plot $(OUT)/figures --quiet

$(OUT)/recordings $(OUT)/measurements $(OUT)/comparisons $(OUT)/figures:
	@mkdir -p $@

sample-data: $(FRICTIONLAB)  ## make sample_data again, bit for bit, from configs/sample_data.toml
	$(FRICTIONLAB) synthesize --scene configs/sample_data.toml -o sample_data

test: .venv/.test  ## install what is needed to test, then run all tests
	$(BIN)/python -m pytest

check: .venv/.test  ## lint, format, types, import rules, docs in step
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest -q -n 0 tests/test_house.py tests/test_docs.py

format: .venv/.test  ## format the code and mend what the linter can
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:  ## remove what was built (the environment in .venv stays)
	rm -rf build

help:  ## list these targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-12s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

$(FRICTIONLAB): pyproject.toml
	@test -n "$(PYTHON)" || { echo "make: no Python >= 3.11 found: install one, or give PYTHON=/path/to/python3" >&2; exit 2; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

.venv/.test: $(FRICTIONLAB)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@
