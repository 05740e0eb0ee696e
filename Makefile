# Everything a person or CI does with the project. `make` lists the targets.

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PLUGINS := $(patsubst %/pyproject.toml,%,$(wildcard plugins/*/*/pyproject.toml))
JS := tests/js
UI := plugins/ocu/web/ui
UI_SOURCES := $(shell find $(UI) -path $(UI)/node_modules -prune -o -type f -print)
PAGE := plugins/ocu/web/m2pem_plugin_web/static/index.html
DEBIAN_PACKAGES := chromium curl nodejs npm spin tcc tmux

# An environment holds absolute paths: one made elsewhere, or by another Python, is made anew.
INSTALLED := $(VENV)/installed
IDENTITY := $(strip $(CURDIR) $(shell $(PYTHON) -V 2>&1) $(PLUGINS))
ifneq ($(shell $(BIN)/python -c '' 2>/dev/null && cat $(INSTALLED) 2>/dev/null),$(IDENTITY))
.PHONY: $(INSTALLED)
endif

.PHONY: help setup python-packages npm-packages page demo demo-web demo-air demo-sitl demo-ros demo-ros-vehicle demo-ros-team demo-team
.PHONY: test test-long test-ros fuzz lint format docs pictures
.PHONY: bench bench-quick conformance clean ros

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' Makefile | expand -t 12

setup: python-packages npm-packages page ## make .venv and install all that the demo and the tests need

python-packages: $(INSTALLED)

$(INSTALLED): pyproject.toml constraints.txt $(PLUGINS:%=%/pyproject.toml)
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "m2pem needs Python 3.11 or newer, and $(PYTHON) is not: try make PYTHON=python3.12" >&2; exit 1; }
	@echo "Installing m2pem and its tools into $(VENV)"
	@$(PYTHON) -m venv --clear $(VENV) || { \
	  echo "$(PYTHON) cannot make virtual environments; on Debian: apt-get install python3-venv" >&2; exit 1; }
	@PIP_CONSTRAINT=constraints.txt PIP_BUILD_CONSTRAINT=constraints.txt $(BIN)/python -m pip install \
	  --quiet --disable-pip-version-check --editable '.[dev,docs]' $(PLUGINS:%=--editable %)
	@echo '$(IDENTITY)' > $@

# The tests of what BPMN editors see need Node.js, those of the terminal unit tmux, those of the web page
# Chromium, and those of verification Spin and a C compiler; nothing else does, so their absence stops nothing.
npm-packages:
	@missing=; for package in $(DEBIAN_PACKAGES); do command -v $${package/nodejs/node} >/dev/null || missing="$$missing $$package"; done; \
	if [ -n "$$missing" ] && [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  echo "Installing Debian packages:$$missing"; \
	  { apt-get update -qq && apt-get install -y -qq $$missing >/dev/null; } || { \
	    echo "apt-get could not install$$missing (its own message is above). Install them by hand, then make setup again" >&2; exit 1; }; \
	fi
	@if command -v npm >/dev/null; then $(MAKE) --silent $(JS)/node_modules/.package-lock.json; \
	else echo "Some tests need Debian packages that are not installed: $(DEBIAN_PACKAGES)" >&2; fi

$(JS)/node_modules/.package-lock.json: $(JS)/package-lock.json $(JS)/.npmrc
	@echo "Installing the npm packages of $(JS)"
	@cd $(JS) && npm ci --loglevel=error >/dev/null
	@touch $@

# Built when the package was installed, and again when it has changed since.
page: python-packages $(PAGE)

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
# Of Nav2, the tests have a double: its own interfaces are in no registry of wheels.
ROS_PACKAGES := ros/m2pem_interfaces plugins/arbiters/ros/tests/nav2_testdouble
ROS_INTERFACES := $(sort $(shell find $(ROS_PACKAGES) -type f -not -name '*.pyc'))
ROS_CACHE := $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/m2pem/ros
ROS_IDENTITY := $(strip $(CURDIR) $(shell $(PYTHON) -V 2>&1))
ifneq ($(shell $(ROS_PYTHON) -c '' 2>/dev/null && cat $(ROS)/created 2>/dev/null),$(ROS_IDENTITY))
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

test-ros: ros ## check the plugins that need ROS, over DDS on 127.0.0.1
	@$(ROS_PYTHON) -m pytest -n 2 -m "not long" $(ROS_TESTS)
	@$(ROS_PYTHON) -m bench --quick --only ros_command,team_orders,ros_fleet,ros_discovery

DEMO := $(BIN)/m2pem run missions/vignette1.bpmn --fleet fleet_configs/vignette1.yaml --simulate --speed 20
ANSWERS := missions/answers/vignette1

# On a terminal only the detector is scripted, and whoever sits there is the operator.
demo: python-packages ## run the paper's mission on simulated vehicles, in two ways
	@if [ -t 0 ] && [ -t 1 ]; then operator=_live; else operator=; fi; \
	echo "The first way: a hazard is detected. Continue; at the second prompt, abort."; \
	$(DEMO) --answers $(ANSWERS)_detection$$operator.yaml; \
	echo; \
	echo "The second way: nothing is detected. Continue, and the route is driven to its end."; \
	$(DEMO) --answers $(ANSWERS)_route$$operator.yaml

DEMO_WEB := .demo-web

# Missions are copied: what is drawn in the demo changes none of the repository.
demo-web: python-packages page ## draw, prove and run missions in a browser, on simulated vehicles
	@mkdir -p $(DEMO_WEB)/missions && { [ -e $(DEMO_WEB)/missions/vignette1.bpmn ] || cp missions/vignette1.bpmn $(DEMO_WEB)/missions; }
	@echo "Open this address in a browser. Ctrl-C ends it."
	@M2PEM_WEB_MISSIONS=$(DEMO_WEB)/missions $(BIN)/m2pem serve --fleet fleet_configs/vignette1.yaml --simulate \
	  --ocu web --journal $(DEMO_WEB)/journal.db

AUTOPILOTS := $(BIN)/m2pem sim mavlink --copters 2 --rovers 1 --speed 10 --ekf 6s --home 38.1075,-77.3192,60 \
  --set FS_GCS_ENABLE=1 --set FS_GCS_TIMEOUT=10 --set BATT_FS_LOW_ACT=2
LINK_LOST := 1: cut link at 80 s for 600 s

demo-air: python-packages ## survey a field with simulated MAVLink vehicles, one of which falls silent
	@echo "Two copters and a rover over MAVLink, ten times as fast as real ones. uav1 will fall silent."
	@$(AUTOPILOTS) --fault "$(LINK_LOST)" & autopilots=$$!; trap 'kill $$autopilots' EXIT; \
	$(BIN)/m2pem run missions/survey_pair.bpmn --fleet fleet_configs/survey_pair.yaml --speed 10

SITL_FLEET := fleet_configs/survey_pair.yaml
# Nothing of ArduPilot comes with m2pem: docs/mavlink.md says how it is built.
SITL_SPEED := 5

demo-sitl: python-packages ## survey a field with real autopilots in the loop: FOLDER=~/ardupilot
	@[ -n "$(FOLDER)" ] || { echo "Say where ArduPilot's programs are: make demo-sitl FOLDER=~/ardupilot" >&2; exit 1; }
	@echo "Two ArduCopters and an ArduRover, $(SITL_SPEED) times as fast as real ones, when they are ready."
	@autopilots=; trap 'for each in $$autopilots; do kill $$each 2>/dev/null || true; $(call TEAM_GONE,$$each); done' EXIT; \
	exec 3< <(exec $(BIN)/m2pem sitl --ardupilot "$(FOLDER)" --fleet $(SITL_FLEET) --speed $(SITL_SPEED) </dev/null); autopilots=$$!; \
	$(call TEAM_READY,3,ready); \
	$(BIN)/m2pem run missions/survey_pair.bpmn --fleet $(SITL_FLEET) --speed $(SITL_SPEED)

ROS_SPEED := 10
# None of those that tests reserve, so that nobody else is met.
ROS_DOMAIN := 101
OPERATOR := examples/t22_operator_over_ros/ros_operator.py

# The simulated vehicles of a fleet ($(1)) and an executive for them, while an operator does $(2). What was
# started ends with it, also by Ctrl-C: the executive first, so that it can leave its vehicles in good order.
define OVER_ROS
@eval "$$($(ROS_PYTHON) -m m2pem_plugin_ros.loopback $(ROS_DOMAIN))"; vehicles= executive=; \
trap 'for each in $$executive $$vehicles; do kill $$each 2>/dev/null || true; wait $$each || true; done' EXIT; \
exec 3< <(exec $(ROS_PYTHON) -m m2pem sim ros --fleet $(1) --speed $(ROS_SPEED) </dev/null); vehicles=$$!; \
while read -r line <&3; do echo "$$line"; [ "$$line" != ready ] || break; done; \
$(ROS_PYTHON) -m m2pem serve --fleet $(1) --ocu mocu --speed $(ROS_SPEED) --journal memory: >/dev/null & executive=$$!; \
operate() { $(ROS_PYTHON) $(OPERATOR) --mission "missions/$$1.bpmn" --answers "$(dir $(ANSWERS))$$2.yaml"; }; \
$(2)
endef

demo-ros: demo-ros-vehicle demo-ros-team ## run missions on simulated ROS 2 vehicles, with an operator over ROS

demo-ros-vehicle: ros
	@echo "A ground vehicle with an m2pem node, $(ROS_SPEED) times as fast as a real one. Its radar finds a mine:"
	@echo "continue; at the second prompt, abort. Then once more: nothing is left to be found, and the route is driven."
	$(call OVER_ROS,fleet_configs/vignette1_ros.yaml,operate vignette1 vignette1_detection; operate vignette1 vignette1_route)

demo-ros-team: ros
	@echo "Three vehicles, reached in three ways, sweep a road as a team; one finds a mine, and they cross the bridge."
	$(call OVER_ROS,fleet_configs/mehds_ros.yaml,operate mehds_vignette_1 mehds_vignette_1_swept)

# As fast as real ones: how quickly a camera is told where to look, is a matter of real time.
TEAM_SPEED := 1
TEAM_FLEET := fleet_configs/mehds_mixed.yaml
# Where the fleet expects the copter.
TEAM_PORT := 14550
TEAM_AUTOPILOT = --copters 1 --ekf 6s --home 38.107162,-77.319941,60 --to udp://127.0.0.1:$(TEAM_PORT) \
  --set FS_GCS_ENABLE=1 --set FS_GCS_TIMEOUT=10 --set BATT_FS_LOW_ACT=2 --set LAND_SPEED=100 --set WPNAV_SPEED_DN=250
# A simulated autopilot, or with FOLDER=~/ardupilot a real one that simulates itself (docs/mavlink.md).
ifdef FOLDER
TEAM_COPTER = exec 6< <(exec $(ROS_PYTHON) -m m2pem sitl --ardupilot "$(FOLDER)" --fleet $(TEAM_FLEET) --speed $(TEAM_SPEED) </dev/null); \
  others+=" $$!"; $(call TEAM_READY,6,ready);
else
TEAM_COPTER = $(ROS_PYTHON) -m m2pem sim mavlink $(TEAM_AUTOPILOT) --speed $(TEAM_SPEED) </dev/null & others+=" $$!";
endif
TEAM_POINTING_DEG := 1
TEAM_END := EndBypassed
TEAM_ANSWERS := missions/answers/team_column_bypassed.yaml
# Each program says on a line of its own that it is ready; one that ends before, ends the demo.
TEAM_READY = line=; until [ "$$line" = $(2) ]; do read -r line <&$(1); echo "$$line"; done

# Bash waits for its own children alone, and not for what it reads from.
TEAM_GONE = while kill -0 $(1) 2>/dev/null; do sleep 0.1; done

# The column, its copter and its camera are simulated by programs of their own; one more measures what they did.
demo-team: ros ## march in a column with a camera and a copter, over ROS 2 and MAVLink, and measure how well
	@echo "Three ROS vehicles march in a column. The camera on the last one scans, a copter follows over MAVLink; the"
	@echo "radar on the first one finds a mine. It takes less than two minutes."
	@eval "$$($(ROS_PYTHON) -m m2pem_plugin_ros.loopback $(ROS_DOMAIN))"; executive= others=; \
	trap 'for each in $$executive $$others; do kill $$each 2>/dev/null || true; $(call TEAM_GONE,$$each); done' EXIT; \
	exec 3< <(exec $(ROS_PYTHON) -m m2pem sim ros --fleet $(TEAM_FLEET) --speed $(TEAM_SPEED) </dev/null); others+=" $$!"; \
	exec 4< <(exec $(ROS_PYTHON) -m m2pem sim ros-cameras --fleet $(TEAM_FLEET) --speed $(TEAM_SPEED) </dev/null); others+=" $$!"; \
	$(TEAM_COPTER) \
	$(call TEAM_READY,3,ready); $(call TEAM_READY,4,ready); \
	$(ROS_PYTHON) -m m2pem serve --fleet $(TEAM_FLEET) --ocu mocu --speed $(TEAM_SPEED) --journal memory: >/dev/null & executive=$$!; \
	exec 5< <(exec $(ROS_PYTHON) -m bench.column --fleet $(TEAM_FLEET) --team camera_last --camera evsg2/ptz \
	  --speed $(TEAM_SPEED) --bound $(TEAM_POINTING_DEG) --reached $(TEAM_END) </dev/null); watch=$$!; others+=" $$watch"; \
	$(call TEAM_READY,5,watching); \
	$(ROS_PYTHON) $(OPERATOR) --mission missions/team_column.bpmn --answers $(TEAM_ANSWERS) --within 300; \
	cat <&5; wait $$watch

lint: setup ## check style, types and layers
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@for plugin in $(PLUGINS); do $(BIN)/mypy $$plugin/m2pem_plugin_*; done
	@$(BIN)/lint-imports
	@cd $(UI) && npm run --silent check

format: setup ## put the code into shape
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

test: lint bench-quick ## check all but the long tests
	@cd $(UI) && npm run --silent test
	@$(BIN)/pytest -n 2 -m "not long"
	@$(MAKE) --silent test-ros

test-long: lint ros ## check everything: fuzzing, large random counts, foreign corpora too
	@$(BIN)/pytest -n 2 --timeout 1800 --hypothesis-profile random
	@$(ROS_PYTHON) -m pytest -n 2 --timeout 1800 --hypothesis-profile random $(ROS_TESTS)

FUZZ_S := 600

fuzz: python-packages ## read and run strange files for FUZZ_S seconds (600)
	@$(BIN)/python -m tests.foreign.fuzz --seconds $(FUZZ_S) $(M2PEM_CORPORA)

docs: python-packages ## build the documentation into site/
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict

pictures: npm-packages page ## draw the missions and examples, and the web page, for the docs (needs Chromium)
	@cd $(JS) && node draw_bpmn.mjs ../../docs/images ../../missions/*.bpmn && \
	for example in ../../examples/*/; do node draw_bpmn.mjs "$$example" "$$example"*.bpmn; done
	@$(BIN)/python -m tests.broken
	@M2PEM_PICTURES=1 $(BIN)/pytest --quiet plugins/ocu/web/tests/test_web_mission_drawn.py

PEERS := .conformance

conformance: setup $(PEERS)/installed ## compare with other BPMN engines, and write the table into the docs
	@$(BIN)/python -m tests.conformance --spiffworkflow $(PEERS)/bin/python

bench: setup ros $(PEERS)/installed ## measure m2pem and other BPMN engines, and write bench/results (about half an hour)
	@$(BIN)/python -m bench

bench-quick: setup ## see that what `make bench` runs does run, and rightly
	@$(BIN)/python -m bench --quick

$(PEERS)/installed: tests/conformance/spiffworkflow.txt
	@echo "Installing SpiffWorkflow into $(PEERS)"
	@$(PYTHON) -m venv --clear $(PEERS)
	@$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check --requirement $<
	@touch $@

clean: ## remove all that can be made again
	@rm -rf $(VENV) $(ROS) $(PEERS) $(JS)/node_modules $(UI)/node_modules $(dir $(PAGE)) build dist site
	@rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache .coverage
	@find . -name __pycache__ -prune -exec rm -rf {} +
