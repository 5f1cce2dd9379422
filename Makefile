# Everything runs in a virtual environment in this folder: no ROS installation is needed and nothing outside is changed.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
MESSAGES := build/messages
MESSAGE_SOURCES := $(wildcard msg_defs/*.txt msg_defs/*.xml msg_defs/msg/*.msg msg_defs/cmake/*.cmake)

# Commands and tests start many processes: the modules are compiled once, also where the environment would forbid it.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.PHONY: help setup demo reproduce verdict test coverage mutants golden node-readers check hooks format terms \
	benchmark benchmark-safety benchmark-bags benchmark-guided benchmark-realistic benchmark-report benchmark-speed docs site lock clean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-20s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(VENV)/.package  ## create the virtual environment, compile the messages, install the package, compile the laws
	@$(BIN)/python -m vessel_hsmc_ros.simulation.compile

demo: setup  ## run the paper's case 2 with the paper's law and with the guided law, and compare them in one page
	@$(BIN)/vessel-hsmc demo

reproduce: setup  ## run every case of the paper, draw its figures, evaluate its claims
	@$(BIN)/vessel-hsmc reproduce

verdict: setup  ## as reproduce, and update docs: claims.md, results.json and the figures of verdict.md
	@$(BIN)/vessel-hsmc reproduce --output build/reproduce
	@cp build/reproduce/claims.md build/reproduce/results.json docs/
	@cp $$(sed -n 's|.*(images/\(.*png\)).*|build/reproduce/figures/\1|p' docs/verdict.md) docs/images/

# Two processes share the tests file by file, because fixtures live as long as their file. Each has a ROS domain of its own.
test: setup  ## run all tests
	@$(BIN)/python -m pytest --numprocesses 2 --dist loadfile --no-loadscope-reorder

coverage: setup  ## measure the line and branch coverage of the tests that run in one process; fails below the floor
	@$(BIN)/python -m pytest --quiet --cov --cov-report=term --ignore test/processes --ignore test/project

mutants: setup  ## apply each known bug of test/mutants to a copy and check that its test fails
	@$(BIN)/python test/mutants/run.py

golden: setup  ## run every scenario, show the differences from its golden run, record it
	@$(BIN)/python test/golden/refresh.py

node-readers:  ## install npm's MCAP reader into build/node, for test/bags
	@mkdir -p build/node
	@npm install --silent --no-audit --no-fund --prefix build/node @mcap/core@2.2.2 @mcap/support@1.1.0 \
		@foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0

check: setup  ## format, lint, types, directions of imports, declared imports, spelling, terms
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports
	@$(BIN)/deptry .
	@$(BIN)/codespell
	@$(BIN)/python test/project/terms.py

hooks: $(VENV)/.dev  ## run the quick checks before each commit of this clone
	@$(BIN)/pre-commit install

format: setup  ## format the code
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .

terms: setup  ## list words that have a standard term instead (test/project/terms.yaml)
	@$(BIN)/python test/project/terms.py

benchmark: setup  ## measure a lockstep step against bare rclpy round trips, the start-up, and the pace in real time
	@$(BIN)/python benchmarks/loop.py
	@$(BIN)/python benchmarks/start_up.py
	@$(BIN)/python benchmarks/real_time.py

benchmark-speed: setup  ## measure compiled runs: against scalar C++, on two cores, of many runs, and the commands that use them
	@$(BIN)/python benchmarks/batch.py
	@$(BIN)/python benchmarks/compiled.py

benchmark-bags: setup  ## measure writing, recording and live viewing, and kill 20 recorders
	@$(BIN)/python benchmarks/bags.py
	@$(BIN)/python benchmarks/watching.py
	@$(BIN)/python benchmarks/kills.py

benchmark-guided: setup  ## run the suite of the guided law at 10, 50 and 100 Hz
	@$(BIN)/python benchmarks/guided.py

benchmark-realistic: setup  ## measure the effect of each part of the realistic ship
	@$(BIN)/python benchmarks/realistic.py

benchmark-safety: setup  ## measure the safety checks, endurance, kills of nodes and the fault matrix: about an hour
	@$(BIN)/python benchmarks/safety.py
	@$(BIN)/python benchmarks/false_alarms.py
	@$(BIN)/python benchmarks/node_kills.py --repeats 20
	@$(BIN)/python benchmarks/faults.py --page docs/faults.md
	@$(BIN)/python benchmarks/soak.py

benchmark-report: setup  ## measure the report of one hour at 100 Hz against its limits
	@$(BIN)/python benchmarks/report.py

docs: setup  ## write docs/parameters.md and the tables of docs/safety.md from the declarations
	@$(BIN)/vessel-hsmc parameters > docs/parameters.md
	@$(BIN)/vessel-hsmc parameters --into docs/safety.md

# The variable suppresses an advertisement for another tool; warnings of the build are errors.
site: $(VENV)/.dev  ## build the documentation with the API reference into build/site
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict
	@echo "Open build/site/index.html"

lock: setup  ## resolve requirements.in and requirements-dev.in into their locks
	@$(BIN)/uv pip compile --quiet --universal --python-version 3.10 --no-annotate --no-header \
		requirements.in --output-file requirements.lock
	@$(BIN)/uv pip compile --quiet --universal --python-version 3.10 --no-annotate --no-header \
		requirements-dev.in --output-file requirements-dev.lock

clean:  ## remove the virtual environment and all builds
	rm -rf $(VENV) build install log *.egg-info

$(VENV)/.requirements: requirements.lock
	@$(PYTHON) -c 'import sys; v = sys.version_info; \
		sys.exit(0 if (3, 10) <= v < (3, 14) else "Python %d.%d is not supported: it takes 3.10 to 3.13" % v[:2])'
	@echo "Setting up the virtual environment in $(VENV), about a minute ..."
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --no-deps --requirement requirements.lock
	@touch $@

$(VENV)/.dev: requirements-dev.lock $(VENV)/.package
	@echo "Installing the tools for documentation and hooks ..."
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --no-deps --requirement requirements-dev.lock
	@touch $@

# The environment's prefix serves as the underlay, like a sourced ROS installation.
$(VENV)/.messages: $(VENV)/.requirements $(MESSAGE_SOURCES)
	@echo "Compiling the messages ..."
	@mkdir -p $(MESSAGES)
	@export AMENT_PREFIX_PATH=$(CURDIR)/$(VENV) PATH=$(CURDIR)/$(BIN):$$PATH; \
	{ cmake -S msg_defs -B $(MESSAGES) -G Ninja -DCMAKE_PREFIX_PATH=$(CURDIR)/$(VENV) \
		-DCMAKE_INSTALL_PREFIX=$(CURDIR)/$(VENV) -DPython3_EXECUTABLE=$(CURDIR)/$(BIN)/python -DBUILD_TESTING=OFF \
	&& cmake --build $(MESSAGES) && cmake --install $(MESSAGES); } > $(MESSAGES)/log.txt 2>&1 \
	|| { tail -n 30 $(MESSAGES)/log.txt; echo "The messages did not compile; the complete log is in $(MESSAGES)/log.txt"; exit 1; }
	@touch $@

$(VENV)/.package: $(VENV)/.messages setup.py setup.cfg pyproject.toml package.xml
	@echo "Installing the package ..."
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@
