# Everything runs in a virtual environment in this folder; no ROS install is needed, nothing outside is touched.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
MESSAGES := build/messages
MESSAGE_SOURCES := $(wildcard msg_defs/*.txt msg_defs/*.xml msg_defs/msg/*.msg msg_defs/cmake/*.cmake)

.DEFAULT_GOAL := help
.PHONY: help setup demo reproduce verdict test golden check format benchmark benchmark-bags benchmark-report benchmark-guided benchmark-realistic docs lock clean

help:  ## show what can be made
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-16s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(VENV)/.package  ## make the virtual environment, compile the messages, install the package

demo: setup  ## run the paper's case 2 over real ROS 2 nodes and record it
	@$(BIN)/vessel-hsmc run case2_tracking

reproduce: setup  ## run every case of the paper, draw its figures, judge its claims
	@$(BIN)/vessel-hsmc reproduce

verdict: setup  ## the same, into docs: claims.md, results.json and the pictures of verdict.md
	@$(BIN)/vessel-hsmc reproduce --output build/reproduce
	@cp build/reproduce/claims.md build/reproduce/results.json docs/
	@cp $$(sed -n 's|.*(images/\(.*png\)).*|build/reproduce/figures/\1|p' docs/verdict.md) docs/images/

# Builds and pure tests share the cores, file by file, since a file's fixtures are made once a process; those with nodes have
# the cores for themselves, because they measure time.
test: setup  ## run all tests
	@$(BIN)/python -m pytest --numprocesses 2 --dist loadfile --ignore test/nodes --ignore test/processes
	@$(BIN)/python -m pytest test/nodes test/processes

golden: setup  ## run every scenario, show what changed since its golden run, record it
	@$(BIN)/python test/golden/refresh.py

check: setup  ## lint, types, direction of imports
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports

format: setup  ## format the code
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .

benchmark: setup  ## measure a lockstep step against bare rclpy round trips
	@$(BIN)/python benchmarks/loop.py

benchmark-bags: setup  ## measure writing, recording and watching, and kill 20 recorders
	@$(BIN)/python benchmarks/bags.py
	@$(BIN)/python benchmarks/watching.py
	@$(BIN)/python benchmarks/kills.py

benchmark-guided: setup  ## run the guided law's whole table at 10, 50 and 100 Hz
	@$(BIN)/python benchmarks/guided.py

benchmark-realistic: setup  ## measure what each part of the realistic ship does
	@$(BIN)/python benchmarks/realistic.py

benchmark-report: setup  ## measure the report of an hour at 100 Hz against its limits
	@$(BIN)/python benchmarks/report.py

docs: setup  ## write docs/parameters.md from the declarations
	@$(BIN)/vessel-hsmc parameters > docs/parameters.md

lock: setup  ## resolve requirements.in into requirements.lock
	@$(BIN)/uv pip compile --quiet --universal --python-version 3.10 --no-annotate --no-header \
		requirements.in --output-file requirements.lock

clean:  ## remove the virtual environment and all builds
	rm -rf $(VENV) build install log *.egg-info

$(VENV)/.requirements: requirements.lock
	@$(PYTHON) -c 'import sys; v = sys.version_info; \
		sys.exit(0 if (3, 10) <= v < (3, 14) else "Python %d.%d is not supported: it takes 3.10 to 3.13" % v[:2])'
	@echo "Setting up the virtual environment in $(VENV), about a minute ..."
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --no-deps --requirement requirements.lock
	@touch $@

# The wheels' prefix is the underlay, as a sourced ROS install would be.
$(VENV)/.messages: $(VENV)/.requirements $(MESSAGE_SOURCES)
	@echo "Compiling the messages ..."
	@mkdir -p $(MESSAGES)
	@export AMENT_PREFIX_PATH=$(CURDIR)/$(VENV) PATH=$(CURDIR)/$(BIN):$$PATH; \
	{ cmake -S msg_defs -B $(MESSAGES) -G Ninja -DCMAKE_PREFIX_PATH=$(CURDIR)/$(VENV) \
		-DCMAKE_INSTALL_PREFIX=$(CURDIR)/$(VENV) -DPython3_EXECUTABLE=$(CURDIR)/$(BIN)/python -DBUILD_TESTING=OFF \
	&& cmake --build $(MESSAGES) && cmake --install $(MESSAGES); } > $(MESSAGES)/log.txt 2>&1 \
	|| { tail -n 30 $(MESSAGES)/log.txt; echo "The messages did not compile; the whole log is in $(MESSAGES)/log.txt"; exit 1; }
	@touch $@

$(VENV)/.package: $(VENV)/.messages setup.py setup.cfg pyproject.toml package.xml
	@echo "Installing the package ..."
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@
