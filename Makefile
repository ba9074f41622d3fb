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
.PHONY: all always campaign chain chapter3 help sample-data tradeoff stability test fuzz check format clean

all: $(FRICTIONLAB)  ## ingest, analyze and compare all logs, then print the table (the default)
	@test -n "$(logs)" || { echo "make: no logs in $(LOGS): expected *.csv (or $(EXTENSIONS)); give LOGS=folder" >&2; exit 2; }
	@status=0; $(MAKE) --no-print-directory --keep-going chain || status=1; \
	cat $(foreach c,$(comparisons),$$(test -f $(c) && echo $(c))) /dev/null > $(OUT)/comparisons.jsonl; \
	$(FRICTIONLAB) show $(OUT)/comparisons.jsonl; \
	for file in $(comparisons); do test -f $$file || echo "failed: $$file (the reason stands above)" >&2; done; \
	echo "recordings, measurements, comparisons and figures are in $(OUT)/"; exit $$status

chain: $(recordings) $(measurements) $(comparisons)

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

# A whole campaign: only logs that are new or changed are ingested and measured again, all of a step in one process.

CAMPAIGN       ?= build/campaign
CAMPAIGN_SCENE ?= configs/campaign.toml
CAMPAIGN_LOGS  ?= $(CAMPAIGN)/logs
campaign_logs   = $(sort $(foreach e,$(EXTENSIONS),$(wildcard $(CAMPAIGN_LOGS)/*.$(e))))

campaign: $(FRICTIONLAB)  ## a whole campaign up to its report: the virtual one, or CAMPAIGN_LOGS=folder CAMPAIGN_SCENE=scene.toml
	@$(if $(filter $(CAMPAIGN)/logs,$(CAMPAIGN_LOGS)),$(MAKE) --no-print-directory $(CAMPAIGN)/logs/truth.jsonl)
	@$(MAKE) --no-print-directory $(CAMPAIGN)/report.html
	@echo "the report is $(CAMPAIGN)/report.html"

$(CAMPAIGN)/logs/truth.jsonl: $(CAMPAIGN_SCENE)
	$(FRICTIONLAB) synthesize --scene $< -o $(@D)

$(CAMPAIGN)/report.html: $(CAMPAIGN)/.measured
	@echo "evaluate the campaign: $(words $(campaign_logs)) tests"
	@$(FRICTIONLAB) campaign $(foreach log,$(campaign_logs),$(call row_of,$(log))) --scene $(CAMPAIGN_SCENE) -o $(@D)

$(CAMPAIGN)/.measured: $(campaign_logs) $(CAMPAIGN_SCENE) $(CAMPAIGN)/names.txt
	@test -n "$(campaign_logs)" || { echo "make: no logs in $(CAMPAIGN_LOGS): give CAMPAIGN_LOGS=folder" >&2; exit 2; }
	@mkdir -p $(CAMPAIGN)/recordings $(CAMPAIGN)/measurements
	@set -- $(sort $(unmeasured_logs) $(filter $(campaign_logs),$(if $(filter $(CAMPAIGN_SCENE),$?),$^,$?))); \
	test $$# -gt 0 || exit 0; echo "ingest and analyze: $$# logs"; \
	$(FRICTIONLAB) ingest "$$@" --scene $(CAMPAIGN_SCENE) -o $(CAMPAIGN)/recordings --json > $(CAMPAIGN)/ingested.jsonl \
		|| test $$? -eq 1 || exit; \
	$(call one_row_a_file,$(CAMPAIGN)/ingested.jsonl); \
	set -- $$(grep -L '"status": "failed"' $$(for log in "$$@"; do $(call shell_row_of,$$log); done) \
		| sed 's|/measurements/\([^/]*\)\.jsonl$$|/recordings/\1.h5|'); \
	test $$# -gt 0 || exit 0; \
	$(FRICTIONLAB) analyze "$$@" --scene $(CAMPAIGN_SCENE) --json > $(CAMPAIGN)/analyzed.jsonl \
		|| test $$? -eq 1 || exit; \
	$(call one_row_a_file,$(CAMPAIGN)/analyzed.jsonl)
	@touch $@

row_of = $(CAMPAIGN)/measurements/$(basename $(patsubst %.gz,%,$(notdir $(1)))).jsonl
shell_row_of = basename "$(1)" | sed 's|\.gz$$||; s|\.[^.]*$$||; s|^|$(CAMPAIGN)/measurements/|; s|$$|.jsonl|'
unmeasured_logs = $(foreach log,$(campaign_logs),$(if $(wildcard $(call row_of,$(log))),,$(log)))

# Row n of a file of rows belongs to the n-th input: a failed one too has its row.
one_row_a_file = for input in "$$@"; do IFS= read -r row <&3; printf '%s\n' "$$row" > "$$($(call shell_row_of,$$input))"; done 3< $(1)

$(CAMPAIGN)/names.txt: always
	@mkdir -p $(@D); echo '$(notdir $(campaign_logs))' | cmp -s - $@ || echo '$(notdir $(campaign_logs))' > $@

always:

sample-data: $(FRICTIONLAB)  ## make sample_data again, bit for bit, from configs/sample_data.toml
	$(FRICTIONLAB) synthesize --scene configs/sample_data.toml -o sample_data
	$(MAKE) build/comparisons/steel_N1.25_r0.3.jsonl LOGS=sample_data SCENE=configs/sample_data.toml OUT=build
	cp build/figures/steel_N1.25_r0.3.comparison.png sample_data/

chapter3: $(FRICTIONLAB)  ## redraw the thesis's chapter 3 from exact steady states, into $(OUT)/chapter3
	$(BIN)/python -m frictionlab.figures.chapter3 $(OUT)/chapter3

tradeoff: $(FRICTIONLAB)  ## measure error and time of every accuracy knob on this machine
	$(FRICTIONLAB) tradeoff -o $(OUT)/tradeoff

stability: $(FRICTIONLAB)  ## draw how errors grow with cycles, towards resonance and with noise
	$(BIN)/python -m frictionlab.figures.stability $(OUT)/figures

test: .venv/.test  ## install what is needed to test, then run all tests
	$(BIN)/python -m pytest

fuzz: .venv/.test  ## read 100,000 damaged logs: no traceback, no hang, no line unaccounted for (eleven minutes on two cores)
	$(BIN)/python -m tests.logs.fuzz --count 100000

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
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / { printf "make %-12s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

$(FRICTIONLAB): pyproject.toml
	@test -n "$(PYTHON)" || { echo "make: no Python >= 3.11 found: install one, or give PYTHON=/path/to/python3" >&2; exit 2; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

.venv/.test: $(FRICTIONLAB)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@
