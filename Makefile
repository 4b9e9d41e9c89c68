# Targets that people and CI both use. With ROS 2 Jazzy from apt sourced, it is used in place of
# the wheels: the environment then sees the system's packages.
SHELL := /bin/bash
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
RUNS := $(VENV)/.runs
COLLECTED := $(VENV)/.collected
PACKAGES := auv_dynamics auv_gvc_controller auv_analysis
SOURCES := $(foreach p,$(PACKAGES),src/$(p)/setup.py src/$(p)/setup.cfg src/$(p)/package.xml)

export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# beside the compiled kernels: both are found by content, wherever a clone lies
export MYPY_CACHE_DIR ?= $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/auv_gvc/mypy
export PYTHONDONTWRITEBYTECODE :=  # else each node and each worker compiles all modules anew

ifeq ($(ROS_DISTRO),jazzy)
VENV_OPTIONS := --system-site-packages
TO_RUN := requirements.txt requirements-apt.txt requirements-build.txt
else
VENV_OPTIONS :=
TO_RUN := requirements.txt requirements-ros.txt requirements-build.txt
endif
REQUIREMENTS := requirements-mesh.txt requirements-mavlink.txt requirements-dev.txt

COUNT ?= 10
SEED ?= 0
LOAD ?= 8
TIMES ?= 1
STEPS ?= 1000000
KILLS ?= 200
DAY ?= 86400
EXAMPLES ?= 500
SEEDS ?= 10
MUTANTS ?= 500
ONLY ?= formulas loops figures nodes pages

.PHONY: help setup case1 case2 test kernels test-loaded quick coverage soak nightly fuzz identify-study properties mutation audit bench bench-growth build colcon-test wheels
.PHONY: lint format hooks interop docs docs-links docs-test docs-tools clean

help:  ## this list
	@sed -nE 's/^([a-z0-9 -]+):[^#]*## *(.*)/\1\t\2/p' $(MAKEFILE_LIST) | column -t -s $$'\t'
	@echo 'Words in capitals are variables, such as: make soak COUNT=3 SEED=1'

setup: $(READY)  ## the environment in .venv

# by uv in two fifths of pip's CPU time; it sees neither packages of the system nor an index that pip was told of
UV := $(BIN)/python -m uv pip install --quiet --system-certs --python $(BIN)/python
PIP := $(BIN)/python -m pip install --quiet --no-compile
install = { test -z "$(VENV_OPTIONS)" && ! $(BIN)/python -m pip config list | grep -q '\.index-url' && $(UV) $(1); } || $(PIP) $(1)

# what runs, half of all that is installed; what nobody imports need not be compiled
$(RUNS): Makefile $(TO_RUN) $(SOURCES)
	@$(PYTHON) -c 'import sys; assert sys.version_info >= (3, 11), "Python 3.11 or newer is needed, found " + sys.version.split()[0]'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV_OPTIONS) $(VENV)
	$(PIP) 'uv>=0.13,<1' || true
	$(call install,$(foreach r,$(TO_RUN),-r $(r)))
	$(PIP) --no-deps --no-build-isolation --use-pep517 $(foreach p,$(PACKAGES),-e src/$(p))
	@touch $@

$(READY): $(RUNS) $(REQUIREMENTS)
	$(call install,$(foreach r,$(REQUIREMENTS),-r $(r)))
	@touch $@

case1 case2: $(RUNS)  ## the paper's experiment: GVC against CL on real nodes, with a report
	$(BIN)/auv run $@ --overwrite
	@echo "open runs/$@/report.html"

# on two cores: the tests of the nodes mostly wait
WORKERS := 4
TEST = $(BIN)/python -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder

test: kernels  ## the tests
	$(TEST)

# once: else the workers compile the same modules side by side; what cannot be imported they report
$(COLLECTED): $(READY)
	$(BIN)/python -m pytest --collect-only -qq > /dev/null || true
	@touch $@

kernels: $(COLLECTED)  ## compile what the tests call, where it is not compiled
	$(BIN)/python tests/compile_kernels.py

# half of the cores for the tests; AUV_GVC_PATIENCE is the factor of every limit
test-loaded: WORKERS := 8
test-loaded: kernels  ## the same beside LOAD busy processes, TIMES in a row, each in an order drawn by SEED, SEED + 1, ...
	for seed in $$(seq $(SEED) $$(($(SEED) + $(TIMES) - 1))); do \
	  AUV_GVC_PATIENCE=$${AUV_GVC_PATIENCE:-4} AUV_GVC_ORDER=$$seed \
	    $(BIN)/python tests/helpers/busy.py $(LOAD) $(TEST) || exit 1; \
	done

quick: kernels  ## the tests that start no nodes: what to run after every change
	$(BIN)/python -m pytest -n 3 --dist loadfile --ignore tests/system --ignore tests/ros

coverage: kernels  ## lines and branches that the tests see: all of the mathematics, nine tenths of the rest
	$(BIN)/python tests/coverage/run.py

soak: setup docs-tools  ## COUNT random runs by SEED, KILLS of nodes, a run of STEPS, one of DAY s, what else takes long
	AUV_GVC_COUNT=$(COUNT) AUV_GVC_SEED=$(SEED) AUV_GVC_STEPS=$(STEPS) AUV_GVC_KILLS=$(KILLS) \
	  AUV_GVC_DAY=$(DAY) $(BIN)/python -m pytest -m long tests

# each of them even where another fails; soak has the long pages of docs, wheels, colcon's install and kills
nightly: docs-tools  ## what takes hours: soak, the tests by colcon and under load, fuzz at length, a draw of mutants
	$(BIN)/python -m pip install --quiet -r requirements-rerun.txt
	$(MAKE) --keep-going --no-print-directory soak colcon-test test-loaded fuzz mutation

identify-study: setup  ## how often the intervals of auv identify cover the truth, over SEEDS noise seeds
	cd tests && $(abspath $(BIN))/python identify_study.py $(SEEDS)

# COUNT is that of soak's runs unless it is given
fuzz: setup  ## broken files, messages and bags: COUNT inputs (100000) drawn by SEED
	$(BIN)/python tests/fuzz/run.py --count $(if $(filter command line,$(origin COUNT)),$(COUNT),100000) --seed $(SEED)

properties: setup  ## the property tests with EXAMPLES examples each, drawn by SEED
	AUV_GVC_EXAMPLES=$(EXAMPLES) $(BIN)/python -m pytest -n 2 --hypothesis-seed=$(SEED) \
	  tests/dynamics tests/controller tests/analysis tests/reference

# in an environment of its own, so that .venv stays what people use
mutation: setup  ## mutants of formulas, nodes, plots and reports: MUTANTS=count or all, SEED=number, ONLY="nodes pages", others or parts of paths
	test -x $(VENV)/mutation/bin/python || $(PYTHON) -m venv $(VENV)/mutation
	$(VENV)/mutation/bin/python -m pip install --quiet -r requirements-mutation.txt
	$(VENV)/mutation/bin/python tests/mutation/run.py --python $(abspath $(BIN))/python \
	    --mutants $(MUTANTS) --seed $(SEED) --only $(ONLY)

audit: setup  ## known vulnerabilities of what is installed; exit code 3: nothing was audited
	test -x $(VENV)/audit/bin/python || $(PYTHON) -m venv $(VENV)/audit
	$(VENV)/audit/bin/python -m pip install --quiet -r requirements-audit.txt
	$(VENV)/audit/bin/python tests/audit/run.py --python $(abspath $(BIN))/python

# without the peers of the registry, what is measured against them is reported as not measured
bench: setup  ## speed against scalar C, ping-pong, readers and peers: benchmarks/README.md
	$(BIN)/python -m pip install --quiet -r requirements-bench.txt || true
	$(BIN)/python benchmarks/run.py

bench-growth: setup  ## how cost grows with batch, horizon, threads, topics and bag length
	$(BIN)/python benchmarks/growth.py

build: setup  ## colcon build of the workspace
	AMENT_PREFIX_PATH="$(abspath $(VENV))$${AMENT_PREFIX_PATH:+:$$AMENT_PREFIX_PATH}" \
	PATH="$(abspath $(BIN)):$$PATH" $(BIN)/python -m colcon build --symlink-install

# TESTS="--pytest-args -k ..." takes some of them
colcon-test: build  ## the tests of the packages as colcon runs them
	. install/local_setup.bash && PATH="$(abspath $(BIN)):$$PATH" $(BIN)/python -m colcon test \
	  --executor sequential --return-code-on-test-failure --event-handlers console_direct+ $(TESTS)

# each wheel from its sdist, so that nothing is in it that the sdist lacks
wheels: setup  ## sdist and wheel of the three packages, in dist/
	for package in $(PACKAGES); do \
	  $(BIN)/python -m build --no-isolation --outdir dist src/$$package || exit 1; \
	done

lint: setup  ## formatting, style, order of imports, types
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports --no-cache
	$(BIN)/mypy

format: setup  ## apply the formatting
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

hooks: setup  ## the same and some hygiene before every commit of this clone
	$(BIN)/pre-commit install

interop: setup  ## read a bag with npm's @mcap/core as well
	$(BIN)/python -m pytest tests/system/test_interop.py

docs-tools: setup  ## what builds the documentation, into .venv
	$(BIN)/python -m pip install --quiet -r requirements-docs.txt

# every warning, also a dead reference, is an error; what was executed is kept below build/docs
SPHINX := AUV_GVC_NOTEBOOKS=$(abspath build/docs/notebooks) $(BIN)/sphinx-build -n -W --keep-going \
  -d build/docs/doctrees docs

docs: docs-tools  ## the documentation as a site that needs no network: build/docs/html/index.html
	PATH="$(abspath $(BIN)):$$PATH" $(SPHINX) build/docs/html

docs-links: docs-tools  ## ask for every link that leaves the site, and list those that are dead
	PATH="$(abspath $(BIN)):$$PATH" $(SPHINX) -b linkcheck build/docs/links

docs-test: docs-tools  ## every block of README and docs, the notebooks and the site
	$(BIN)/python -m pytest tests/docs -m 'long or not long'

clean:  ## remove what is made here
	rm -rf $(VENV) build dist install log runs docs/_figures
