# Everything a person or CI does with the project. `make` lists the targets.

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
# Tests start the same programs hundreds of times: these are compiled once, not at each start.
unexport PYTHONDONTWRITEBYTECODE

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PLUGINS := $(patsubst %/pyproject.toml,%,$(wildcard plugins/*/*/pyproject.toml))
JS := tests/js
UI := plugins/ocu/web/ui
UI_SOURCES := $(shell find $(UI) -path $(UI)/node_modules -prune -o -type f -print)
PAGE := plugins/ocu/web/m2pem_plugin_web/static/index.html
# a/b: b where the distribution has no a. Chromium without windows takes the tests less time.
DEBIAN_PACKAGES := chromium-headless-shell/chromium curl iproute2 mosquitto nodejs npm openssl postgresql spin systemd tcc tmux

# An environment holds absolute paths: one made elsewhere, or by another Python, is made anew. Which Python the
# shell has counts only where it was asked for (PYTHON=...). One that make has not made is left alone.
# Each target adds what it needs: a demonstration a few packages, the tests all (`installed`).
CREATED := $(VENV)/created
INSTALLED := $(VENV)/installed
IDENTITY := $(strip $(CURDIR) $(shell { $(if $(filter file,$(origin PYTHON)),$(BIN)/python,$(PYTHON)) -V; } 2>&1))
ifeq ($(shell { $(BIN)/python -c '' && cat $(CREATED); } 2>/dev/null),$(IDENTITY))
packages_for = $(or $(wildcard $(INSTALLED)),$(VENV)/for-$(1))
else
.PHONY: $(CREATED)
packages_for = $(VENV)/for-$(1)
endif
DEMO_PLUGINS := plugins/ocu/terminal
DEMO_AIR_PLUGINS := plugins/arbiters/mavlink plugins/ocu/terminal
DEMO_WEB_PLUGINS := plugins/ocu/web
PIP = PIP_CONSTRAINT=constraints.txt PIP_BUILD_CONSTRAINT=constraints.txt $(BIN)/python -m pip \
  --quiet --disable-pip-version-check
PIP_FAILED = { echo "pip could not install what is needed (its own message is above): is a package index reachable? \
  Then the same make command again" >&2; exit 1; }

.PHONY: help setup python-packages npm-packages page demo demo-web demo-air demo-sitl demo-ros demo-team demo-gateway
.PHONY: check page-test test test-long test-ros fuzz chaos lint format docs pictures
.PHONY: bench bench-quick conformance clean dist ros

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' Makefile | expand -t 12

setup: python-packages npm-packages page $(VENV)/collected ## install all that the tests need, into .venv

python-packages: $(INSTALLED)

# One process compiles the tests, once: otherwise each worker of the first run would. Mistakes in them are that run's.
$(VENV)/collected: $(INSTALLED) | python-packages
	@$(BIN)/pytest --collect-only -q -m "not long" >/dev/null 2>&1 || true
	@touch $@

$(CREATED):
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "m2pem needs Python 3.11 or newer, and $(PYTHON) is not: try make PYTHON=python3.12" >&2; exit 1; }
	@[ ! -e $(VENV) ] || [ -e $@ ] || { \
	  echo "$(VENV) was not made by make, which would empty it. Use it without make (docs/start.md), let make have another" \
	    "one (the same make command with VENV=.venv-make), or remove it: rm -r $(VENV)" >&2; exit 1; }
	@[ ! -e $(VENV) ] || echo "Making $(VENV) anew: it was made in another folder, or by another Python"
	@$(PYTHON) -m venv --clear $(VENV) || { rm -rf $(VENV); \
	  echo "$(PYTHON) cannot make virtual environments; on Debian: apt-get install python3-venv" >&2; exit 1; }
	@echo "$(CURDIR) $$($(BIN)/python -V)" > $@

$(INSTALLED): $(CREATED) pyproject.toml constraints.txt $(PLUGINS:%=%/pyproject.toml)
	@echo "Installing m2pem, its plugins and what their tests need into $(VENV)"
	@$(PIP) install --editable '.[dev,docs]' $(PLUGINS:%=--editable %) || $(PIP_FAILED)
	@touch $@

$(VENV)/for-demo: $(DEMO_PLUGINS:%=%/pyproject.toml)
$(VENV)/for-demo: NEEDED = $(DEMO_PLUGINS)
$(VENV)/for-demo-air: $(DEMO_AIR_PLUGINS:%=%/pyproject.toml)
$(VENV)/for-demo-air: NEEDED = $(DEMO_AIR_PLUGINS)
$(VENV)/for-demo-web: $(DEMO_WEB_PLUGINS:%=%/pyproject.toml)
$(VENV)/for-demo-web: NEEDED = $(DEMO_WEB_PLUGINS)

$(VENV)/for-%: $(CREATED) pyproject.toml constraints.txt
	@echo "Installing m2pem with $(NEEDED) into $(VENV); this takes about half a minute"
	@$(PIP) install --editable . $(NEEDED:%=--editable %) || $(PIP_FAILED)
	@touch $@

# The tests of what BPMN editors see need Node.js, those of the terminal unit tmux, those of the web page
# Chromium, those of journals PostgreSQL, those of VDA 5050 mosquitto, and those of verification Spin and a C compiler; nothing else does, so their absence stops nothing.
npm-packages:
	@missing=; for wanted in $(DEBIAN_PACKAGES); do first=$${wanted%%/*}; \
	  program=$${first/nodejs/node}; program=$${program/iproute2/ip}; \
	  PATH=$$PATH:/usr/sbin command -v $${program/postgresql/pg_ctlcluster} >/dev/null || \
	  { command -v $${wanted#*/} >/dev/null && ! apt-cache show $$first >/dev/null 2>&1; } || missing="$$missing $$wanted"; \
	done; \
	if [ -n "$$missing" ] && [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  apt-get update -qq || echo "apt-get could not update its lists (its own message is above)" >&2; \
	  failed=; for wanted in $$missing; do \
	    for package in $${wanted//\// } ''; do \
	      [ -n "$$package" ] || { failed="$$failed $$wanted"; break; }; \
	      echo "You are root: installing the Debian package $$package, which tests need"; \
	      ! apt-get install -y -qq $$package >/dev/null || break; \
	    done; \
	  done; \
	  [ -z "$$failed" ] || { \
	    echo "apt-get could not install$$failed (its own message is above). Install by hand, then make setup again" >&2; exit 1; }; \
	fi
	@if command -v npm >/dev/null; then $(MAKE) --silent $(JS)/node_modules/.package-lock.json; \
	else echo "Some tests need Debian packages that are not installed: $(DEBIAN_PACKAGES)" >&2; fi

$(JS)/node_modules/.package-lock.json: $(JS)/package-lock.json $(JS)/.npmrc
	@echo "Installing the npm packages of $(JS)"
	@cd $(JS) && npm ci --loglevel=error >/dev/null
	@touch $@

# Built when the package was installed, and again when it has changed since.
page: $(PAGE)

$(PAGE): $(UI_SOURCES)
	@command -v npm >/dev/null || { echo "The web page has changed; building it needs Node.js with npm" >&2; exit 1; }
	@echo "Building the web page"
	@cd $(UI) && npm ci --loglevel=error >/dev/null && npm run --silent build -- --logLevel warn

# The wheels of ROS make every Python of their environment start twice (docs/ros.md): they get one of their own.
ROS := .venv-ros
ROS_PYTHON := $(ROS)/bin/python
ROS_PLUGINS := $(wildcard plugins/arbiters/ros plugins/ocu/mocu)
ROS_TESTS := $(ROS_PLUGINS:%=%/tests) $(wildcard plugins/arbiters/ptz/tests/test_ptz_ros_*.py)
ROS_PIP := PIP_CONSTRAINT=ros/constraints.txt PIP_BUILD_CONSTRAINT=ros/constraints.txt \
  $(ROS_PYTHON) -m pip --quiet --disable-pip-version-check
# Of Nav2, the tests have a double: its own interfaces are in no registry of wheels, nor are those of ros/wheels.
ROS_PACKAGES := ros/m2pem_interfaces ros/wheels/geographic_msgs ros/wheels/tf2_msgs \
  plugins/arbiters/ros/tests/nav2_testdouble
ROS_INTERFACES := $(sort $(shell find $(ROS_PACKAGES) -type f -not -name '*.pyc'))
ROS_CACHE := $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/m2pem/ros
ROS_IDENTITY := $(strip $(CURDIR) $(shell $(PYTHON) -V 2>&1))
ifneq ($(shell { $(ROS_PYTHON) -c '' && cat $(ROS)/created; } 2>/dev/null),$(ROS_IDENTITY))
.PHONY: $(ROS)/created
endif

ros: $(ROS)/interfaces $(ROS)/installed ## make .venv-ros: m2pem, ROS 2 and the plugins that need it

$(ROS)/created: ros/constraints.txt
	@$(PYTHON) -m venv --clear $(ROS)
	@echo '$(ROS_IDENTITY)' > $@

# They take minutes to compile: what the same Python built of the same files is kept.
$(ROS)/interfaces: $(ROS)/created $(ROS_INTERFACES)
	@kept=$(ROS_CACHE)/$$({ $(ROS_PYTHON) -VV; sha256sum ros/constraints.txt $(ROS_INTERFACES); } | sha256sum | cut -c 1-16); \
	if [ ! -d "$$kept" ]; then \
	  echo "Building interfaces of ROS; this takes minutes, once"; \
	  mkdir -p "$(ROS_CACHE)"; building=$$(mktemp -d "$(ROS_CACHE)/building.XXXXXX"); trap 'rm -rf "$$building"' EXIT; \
	  $(ROS_PIP) wheel --no-deps --wheel-dir "$$building" $(ROS_PACKAGES:%=./%); \
	  mv -T "$$building" "$$kept" 2>/dev/null || [ -d "$$kept" ]; \
	fi; \
	$(ROS_PIP) install --no-deps --force-reinstall "$$kept"/*.whl
	@touch $@

$(ROS)/installed: $(ROS)/created pyproject.toml constraints.txt $(PLUGINS:%=%/pyproject.toml) | $(ROS)/interfaces
	@echo "Installing m2pem and ROS 2 into $(ROS)"
	@$(ROS_PIP) install --editable '.[dev]' $(patsubst %,--editable %,$(filter-out $(ROS_PLUGINS),$(PLUGINS))) \
	  $(ROS_PLUGINS:%=--editable '%[wheels]')
	@touch $@

# Real browsers, autopilots and DDS keep to the wall clock: what fails beside many others is run once more without
# them, and has to pass. Both results are printed.
ALONE := -n 0 --last-failed --last-failed-no-failures none -m "not long"
ONCE_MORE := What has failed is run once more, alone:
ROS_CACHE_DIR := -o cache_dir=.pytest_cache/ros

# They wait, for DDS and for what moves, two thirds of their time: two workers for each processor have enough to do.
# Neighbours stay together (worksteal), as the tests of a file share processes.
ROS_WORKERS := 4

test-ros: ros ## check the plugins that need ROS, over DDS on 127.0.0.1
	@$(ROS_PYTHON) -m pytest $(ROS_CACHE_DIR) -n $(ROS_WORKERS) --dist worksteal -m "not long" $(ROS_TESTS) || \
	{ [ $$? = 1 ] && echo "$(ONCE_MORE)" && $(ROS_PYTHON) -m pytest $(ROS_CACHE_DIR) $(ALONE) $(ROS_TESTS); }

demo: $(call packages_for,demo) ## run the paper's mission on simulated vehicles, in two ways
	@$(BIN)/m2pem demo

demo-web: $(call packages_for,demo-web) page ## draw, prove and run missions in a browser, on simulated vehicles
	@$(BIN)/m2pem demo web

demo-air: $(call packages_for,demo-air) ## survey a field with simulated MAVLink vehicles, one of which falls silent
	@$(BIN)/m2pem demo air

demo-sitl: $(call packages_for,demo-air) ## survey a field with real autopilots in the loop: FOLDER=~/ardupilot
	@[ -n "$(FOLDER)" ] || { echo "Say where ArduPilot's programs are: make demo-sitl FOLDER=~/ardupilot" >&2; exit 1; }
	@$(BIN)/m2pem demo air --ardupilot "$(FOLDER)"

demo-ros: ros ## run missions on simulated ROS 2 vehicles, with an operator over ROS
	@$(ROS_PYTHON) -m m2pem demo ros

demo-team: ros ## march in a column with a camera and a copter, over ROS 2 and MAVLink, and measure how well
	@$(ROS_PYTHON) -m m2pem demo team $(if $(FOLDER),--ardupilot "$(FOLDER)")

demo-gateway: ros ## show ROS rovers and MAVLink copters to a ROS client and a ground station
	@$(ROS_PYTHON) -m m2pem demo gateway

lint: setup ## check style, types and layers
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports
	@cd $(UI) && npm run --silent check

format: setup ## put the code into shape
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

# Tests wait a third of their time: two workers for each processor keep these busy.
WORKERS := 4
UNITS := $(addprefix tests/,api bpmn control_socket deconfliction diagram editing engine executive fleet geo journal \
  mission rehearsal scripting services simulation teams telemetry)

check: lint ## check style, types, layers and the core's unit tests: two minutes
	@$(BIN)/pytest -n 2 -m "not long" $(UNITS)

# What the tests leave of the processors, the others use, one after the other; each is printed when it has ended.
ASIDE := test-ros lint page-test bench-quick

test: setup ## check all but the long tests
	@$(MAKE) --silent --jobs 2 test-core $(ASIDE:%=%-aside)

.PHONY: test-core $(ASIDE:%=%-aside)

# The tests of ROS have the processor first: DDS drops what comes too late.
test-core:
	@nice -n 5 $(BIN)/pytest -n $(WORKERS) --dist worksteal -m "not long" || \
	{ [ $$? = 1 ] && echo "$(ONCE_MORE)" && $(BIN)/pytest $(ALONE); }

$(ASIDE:%=%-aside): %-aside:
	@status=0; printed=$$($(MAKE) --silent $* ROS_WORKERS=2 2>&1) || status=$$?; echo "$$printed"; exit $$status

# The unit tests of the page's own code.
page-test: setup
	@cd $(UI) && npm run --silent test

test-long: lint ros ## check everything: fuzzing, large random counts, foreign corpora too
	@$(BIN)/pytest -n 2 --timeout 1800 --hypothesis-profile random
	@$(ROS_PYTHON) -m pytest -n 2 --timeout 1800 --hypothesis-profile random $(ROS_TESTS)
	@$(ROS_PYTHON) -m bench --quick --only ros_command,team_orders,ros_fleet,ros_discovery,face_latency,face_load

FUZZ_S := 600

fuzz: python-packages ## read and run strange files for FUZZ_S seconds (600)
	@$(BIN)/python -m tools.fuzzer.fuzz --seconds $(FUZZ_S) $(M2PEM_CORPORA)

CHAOS_ROUNDS := 1000
# One of these alone again: make chaos CHAOS="--seed 5 --round 17"
CHAOS :=

OF_ROS := $(findstring --vehicles ros,$(CHAOS))
chaos: $(if $(OF_ROS),ros,python-packages) ## kill executives at chosen points and random moments, CHAOS_ROUNDS times (1000)
	@$(if $(OF_ROS),$(ROS_PYTHON),$(BIN)/python) -m tests.chaos --rounds $(CHAOS_ROUNDS) $(CHAOS)

dist: $(CREATED) ## build the wheels of m2pem and its plugins, into dist/
	@echo "Building the wheels of m2pem and its plugins into dist; this takes about two minutes"
	@rm -rf dist && mkdir dist
	@$(PIP) wheel --no-deps --wheel-dir dist . $(PLUGINS:%=./%) || $(PIP_FAILED)
	@ls dist

docs: python-packages ## build the documentation into site/
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict

PICTURED := mission_drawn first_mission editor_map editor_survey editor_terrain plots cameras fleet_page

pictures: npm-packages page ## draw the missions and examples, and the web page, for the docs (needs Chromium)
	@cd $(JS) && node draw_bpmn.mjs ../../docs/images ../../missions/*.bpmn && \
	node draw_bpmn.mjs ../../docs/tutorials/patrol ../../docs/tutorials/patrol/*.bpmn && \
	for example in ../../examples/*/; do node draw_bpmn.mjs "$$example" "$$example"*.bpmn; done
	@$(BIN)/python -m tools.broken_mission_pictures
	@M2PEM_PICTURES=1 $(BIN)/pytest --quiet $(PICTURED:%=plugins/ocu/web/tests/test_web_%.py)

PEERS := .conformance

conformance: setup $(PEERS)/installed ## compare with other BPMN engines, and write the table into the docs
	@$(BIN)/python -m tools.conformance --spiffworkflow $(PEERS)/bin/python

bench: setup ros $(PEERS)/installed ## measure m2pem and other BPMN engines, and write bench/results (about half an hour)
	@$(BIN)/python -m bench

bench-quick: setup ## see that what `make bench` runs does run, and rightly
	@$(BIN)/python -m bench --quick

$(PEERS)/installed: tools/conformance/spiffworkflow.txt
	@echo "Installing SpiffWorkflow into $(PEERS)"
	@$(PYTHON) -m venv --clear $(PEERS)
	@$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check --requirement $<
	@touch $@

clean: ## remove all that can be made again
	@rm -rf $(VENV) $(ROS) $(PEERS) $(JS)/node_modules $(UI)/node_modules $(dir $(PAGE)) build dist site
	@rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache .coverage
	@find . -name __pycache__ -prune -exec rm -rf {} +
