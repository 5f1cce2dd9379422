# Everything runs in a virtual environment in this folder: no ROS installation is needed and nothing outside is changed.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
MESSAGE_SOURCES := $(wildcard msg_defs/*.txt msg_defs/*.xml msg_defs/msg/*.msg msg_defs/action/*.action msg_defs/cmake/*.cmake)

# Commands and tests start many processes: the modules are compiled once, also where the environment would forbid it.
export PYTHONDONTWRITEBYTECODE :=

# One environment has ROS 2 Kilted in place of Jazzy, and all else alike.
LOCKS := requirements.lock
ifeq ($(VENV),.venv-kilted)
LOCKS := requirements-kilted.lock build/without_ros.lock
COMPILE := --compile
endif

# Another ROS whose workspace is sourced in this shell would mix with the one in the environment.
unexport AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH PYTHONHOME PYTHONPATH RMW_IMPLEMENTATION ROS_DISTRO
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE
ifdef LD_LIBRARY_PATH
empty :=
space := $(empty) $(empty)
export LD_LIBRARY_PATH := $(subst $(space),:,$(foreach path,$(subst :, ,$(LD_LIBRARY_PATH)),$(if $(wildcard $(path)/librcl.so),,$(path))))
endif

# An environment holds the path of its folder: in a copied or moved folder it is made anew.
MOVED := $(shell test -f $(VENV)/bin/pip && ! grep -qF "$(CURDIR)/$(VENV)/" $(VENV)/bin/pip && rm -f $(VENV)/.requirements && echo --clear)

# Of several `make` in this folder one sets it up, and the others wait.
LOCKED = @mkdir -p build && exec 9> build/.lock && { flock --nonblock 9 || { \
	echo "Another make sets this folder up: waiting for it ..."; flock 9; }; } && $(MAKE) --no-print-directory --silent

.DEFAULT_GOAL := help
.PHONY: help setup tools laws definitions wheels try-wheels demo reproduce verdict test test-long test-kilted coverage mutants golden node-readers check check-types check-text hooks format terms \
	benchmark benchmark-page benchmark-safety benchmark-bags benchmark-guided benchmark-realistic benchmark-report benchmark-speed docs site dev lock clean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-20s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup:  ## create the virtual environment with what running needs, and the package in it
	$(LOCKED) $(VENV)/.compiler

tools:  ## setup, and what tests, checks, wheels and studies need: campaigns, tuning, the live view
	$(LOCKED) $(VENV)/.tools

laws: setup  ## compile the control laws beforehand, about four minutes; otherwise the first simulation of each does
	@$(BIN)/python -m vessel_hsmc_ros.simulation.compile

definitions: tools  ## compile the messages of other packages that tests speak, about a minute; otherwise their tests do
	@$(BIN)/python test/support/definitions.py

wheels: tools  ## build the wheels of package and messages into dist, for this version of Python, and the source archive
	@$(BIN)/python tools/messages.py --wheel
	@$(BIN)/uv build --quiet --no-build-isolation --python $(BIN)/python --out-dir dist

try-wheels: wheels  ## install the wheels into an empty environment without a compiler, and run the demo there
	@$(BIN)/python tools/try_wheels.py

demo:  ## set up as far as it needs, run the paper's case 2 with the paper's law, repaired and as printed, and with guided, and compare them in one page
	$(LOCKED) $(VENV)/.package
	@$(BIN)/vessel-hsmc demo

reproduce: setup  ## run every case of the paper, draw its figures, evaluate its claims
	@$(BIN)/vessel-hsmc reproduce

verdict: setup  ## as reproduce, and update docs: claims.md, results.json and the figures of verdict.md and printed_law.md
	@$(BIN)/vessel-hsmc reproduce --output build/reproduce
	@cp build/reproduce/claims.md build/reproduce/results.json docs/
	@$(BIN)/python tools/docs/verdict_page.py docs
	@cp $$(sed -n 's|.*(images/\(.*png\)).*|build/reproduce/figures/\1|p' docs/verdict.md docs/printed_law.md) docs/images/

# Three processes share the tests file by file, because fixtures live as long as their file: on two cores one works while others
# wait for nodes. Each has a ROS domain of its own.
# One that ends, by a crash or because a test hangs, ends the run: what is left would not be scheduled.
SHARED := --numprocesses 3 --dist loadfile --no-loadscope-reorder --max-worker-restart 0
test: tools laws definitions  ## run all tests but the long ones, some eight minutes
	@$(BIN)/python -m pytest -m 'not long and not alone' $(SHARED)

test-long: tools laws definitions  ## run the long tests: builds by pip and colcon; demo, soak, tutorial; further parameters of costly tests
	@$(BIN)/python -m pytest -m 'long and not alone' $(SHARED)
	@$(BIN)/python -m pytest -m alone

test-kilted:  ## run the tests of the nodes with ROS 2 Kilted, in an environment of its own in .venv-kilted
	@$(MAKE) --no-print-directory VENV=.venv-kilted definitions
	@.venv-kilted/bin/python -m pytest test/nodes $(SHARED)

coverage: tools  ## measure the line and branch coverage of the tests that run in one process; fails below the floor
	@$(BIN)/python -m pytest --quiet --cov --cov-report=term --ignore test/processes --ignore test/project

SINCE ?= HEAD~1
mutants: tools  ## check that tests notice the known bugs of test/mutants, and bugs drawn from what changed since SINCE=commit
	@$(BIN)/python test/mutants/run.py
	@$(BIN)/python test/mutants/draw.py --since $(SINCE)

golden: tools  ## run every scenario and every part alone, show the differences from what is recorded, record it
	@$(BIN)/python test/golden/refresh.py

node-readers:  ## install npm's MCAP reader into build/node, for test/bags
	@mkdir -p build/node
	@npm install --silent --no-audit --no-fund --prefix build/node @mcap/core@2.2.2 @mcap/support@1.1.0 \
		@foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0

# The annotations of the last NumPy for Python 3.10 know less of arrays: what differs is checked with later versions.
OLD_NUMPY := $(addprefix --disable-error-code=,arg-type assignment no-any-return no-untyped-call return-value)

# The checks are independent of each other, and all problems are shown.
check: tools  ## format, lint, types, directions of imports, declared imports, spelling, terms
	@$(MAKE) --no-print-directory --jobs --keep-going --output-sync check-types check-text terms

# With status 2 mypy did not check: on a busy machine its workers miss their time limit. Then it does without them.
check-types: FOR_NUMPY = $(shell $(BIN)/python -c 'import sys; print(sys.version_info < (3, 11) and "$(OLD_NUMPY)" or "")')
check-types:
	@$(BIN)/mypy --num-workers 2 $(FOR_NUMPY) || { test $$? -gt 1 && $(BIN)/mypy $(FOR_NUMPY); }

check-text:
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/lint-imports
	@$(BIN)/deptry .
	@$(BIN)/codespell

hooks: dev  ## run the quick checks before each commit of this clone
	@$(BIN)/pre-commit install

format: tools  ## format the code
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .

terms: tools  ## list words that have a standard term instead (test/project/terms.yaml)
	@$(BIN)/python test/project/terms.py

benchmark: tools  ## measure a lockstep step against bare rclpy round trips, the start-up, and the pace in real time
	@$(BIN)/python benchmarks/loop.py
	@$(BIN)/python benchmarks/start_up.py
	@$(BIN)/python benchmarks/real_time.py

ONLY ?=
benchmark-page: tools  ## measure the quick rows of benchmarks/results.yaml, or ONLY="name ...", and write docs/results.md and README's table
	@$(BIN)/python benchmarks/page.py $(if $(ONLY),--only $(ONLY))

benchmark-speed: tools  ## measure compiled runs: against scalar C++, on two cores, of many runs, and the commands that use them
	@$(BIN)/python benchmarks/batch.py
	@$(BIN)/python benchmarks/compiled.py

benchmark-bags: tools  ## measure writing, recording and live viewing, and kill 20 recorders
	@$(BIN)/python benchmarks/bags.py
	@$(BIN)/python benchmarks/watching.py
	@$(BIN)/python benchmarks/kills.py

benchmark-guided: tools  ## run the suite of the guided law at 10, 50 and 100 Hz
	@$(BIN)/python benchmarks/guided.py

benchmark-realistic: tools  ## measure the effect of each part of the realistic ship
	@$(BIN)/python benchmarks/realistic.py

benchmark-safety: tools  ## measure the safety checks, endurance, kills of nodes and the fault matrix: about an hour
	@$(BIN)/python benchmarks/safety.py
	@$(BIN)/python benchmarks/false_alarms.py
	@$(BIN)/python benchmarks/node_kills.py --repeats 20
	@$(BIN)/python benchmarks/faults.py --page docs/faults.md
	@$(BIN)/python benchmarks/soak.py

benchmark-report: tools  ## measure the report of one hour at 100 Hz against its limits
	@$(BIN)/python benchmarks/report.py

docs: tools  ## write docs/parameters.md, docs/boats.md, tables of docs/safety.md and docs/faults.md, and policy.xml from the declarations
	@$(BIN)/python tools/docs/pages.py

# The variable suppresses an advertisement for another tool; warnings of the build are errors.
site: dev  ## build the documentation with the API reference into build/site
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict
	@echo "Open build/site/index.html"

lock: tools  ## resolve the requirements*.in into their locks
	@for kind in "" -compiler -tools -dev -kilted; do $(MAKE) --silent build/without_ros.lock; \
		$(BIN)/uv pip compile --quiet --universal --python-version 3.10 --generate-hashes \
		--no-annotate --no-header requirements$$kind.in --output-file requirements$$kind.lock || exit 1; done

clean:  ## remove the virtual environment and all builds
	rm -rf $(VENV) .venv-kilted build dist install log *.egg-info

INSTALL := @$(BIN)/python tools/install.py
FROM = --no-deps --require-hashes $(addprefix --requirement ,$(filter %.lock,$^))

dev:
	$(LOCKED) $(VENV)/.dev

build/without_ros.lock: requirements.lock
	@mkdir -p build
	@awk '/^[a-z]/ {kept = !/^ros-/} kept' $< > $@

$(VENV)/.requirements: $(LOCKS)
	@$(PYTHON) tools/preflight.py
	@$(PYTHON) tools/install.py --run "Setting up the virtual environment in $(VENV)" $(PYTHON) -m venv $(MOVED) $(VENV)
	$(INSTALL) "Installing what running needs" $(FROM)
	@touch $@

$(VENV)/.compiler: requirements-compiler.lock $(VENV)/.package
	$(INSTALL) "Installing what compiles simulations" $(FROM)
	@touch $@

$(VENV)/.tools: requirements-tools.lock $(VENV)/.compiler
	$(INSTALL) "Installing what tests, checks and studies need" $(FROM)
	@touch $@

$(VENV)/.dev: requirements-dev.lock $(VENV)/.tools
	$(INSTALL) "Installing the tools for documentation and hooks" $(FROM)
	@touch $@

$(VENV)/.messages: $(VENV)/.requirements $(MESSAGE_SOURCES)
	@$(BIN)/python tools/messages.py $(COMPILE)
	@touch $@

$(VENV)/.package: $(VENV)/.messages setup.py setup.cfg pyproject.toml package.xml benchmarks/ship_family/pyproject.toml
	@rm -rf vessel_hsmc_ros.egg-info # of a build in this folder: it would hide the laws that the package registers
	$(INSTALL) "Installing the package" --no-deps --no-build-isolation --editable . --editable ./benchmarks/ship_family
	@touch $@
