# make run    the main job: the node suite records a bag of several rooms, checks it and draws a contact sheet
# make test   tests, in three processes, of which one waits for nodes; WORKERS=N in N, WORKERS= in one; TESTS=FOLDER some
# make test-slow  the rest: runs of many processes, shared, ended or compared
# make lint   ruff and mypy
# make coverage  both kinds of tests, and which lines they reach
# make bench  speed tables       make setup  only the environment that running needs
# make gallery  contact sheets of every model and material and of a room of each type, in docs/gallery
# make docs   the pages and pictures in docs that are made from the code
# make soak   long runs and injected faults
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SEED ?= 1
ROOMS ?= 4
FRAMES ?= 8
WORKERS ?= 3

# With a sourced system ROS 2 the virtual environment sees its rclpy; without one it gets the wheels.
SYSTEM_ROS := $(shell $(PYTHON) -c 'import rclpy' 2>/dev/null && echo yes)
ifeq ($(SYSTEM_ROS),yes)
VENV_FLAGS := --system-site-packages
RUNNING := denoise,fast
else
VENV_FLAGS :=
RUNNING := ros,denoise,fast
endif
DEVELOPING := $(RUNNING),exr,test,bench
PIP := $(BIN)/pip install --quiet --disable-pip-version-check

.PHONY: setup run test test-slow coverage soak lint bench docs gallery clean

setup: $(VENV)/.ready

.PHONY: develop
# what tests, lint, benches and docs need besides
develop: $(VENV)/.develop

.PHONY: interfaces
# message packages that the wheels lack, compiled for the tests; needs gcc, g++ and python3-dev
interfaces: develop
	@$(BIN)/python test/interfaces/build.py

$(VENV)/.ready: setup.py requirements.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || { echo "scene_synth_ros needs Python 3.10 or newer; got $$($(PYTHON) --version)"; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { echo "Python's venv module is missing: apt install python3-venv"; exit 1; }
	@echo "setting up $(VENV) (once; about half a minute)"
	@$(PYTHON) -m venv $(VENV_FLAGS) $(VENV)
	@$(PIP) --upgrade pip
	@PYTHONWARNINGS=ignore $(PIP) --editable ".[$(RUNNING)]"
	@touch $@

$(VENV)/.develop: $(VENV)/.ready
	@echo "adding to $(VENV) what tests need (once; about half a minute)"
	@PYTHONWARNINGS=ignore $(PIP) --editable ".[$(DEVELOPING)]"
	@touch $@

run: setup
	@$(BIN)/python -m scene_synth_ros run --params demo --seed $(SEED) --rooms $(ROOMS) --frames $(FRAMES) \
		--record runs/$$(date +%Y%m%d-%H%M%S) --contact-sheet contact_sheet.png

test: develop interfaces
	$(BIN)/python -m pytest $(if $(WORKERS),-n $(WORKERS)) $(TESTS)

test-slow: develop interfaces
	$(BIN)/python -m pytest $(if $(WORKERS),-n $(WORKERS)) -m slow $(TESTS)

# which lines the tests reach; compiled kernels count as not reached, so the figure is of the code around them
coverage: develop interfaces
	$(BIN)/python -m pytest $(if $(WORKERS),-n $(WORKERS)) -m "not soak" --cov=scene_description --cov=grammar --cov=renderer --cov=evaluation --cov=scene_synth_ros --cov-report=term:skip-covered

# hours at full size; SOAK_FRAMES, SOAK_SIZE=160x120, SOAK_KILLS, SOAK_SCENES, SOAK_PARAMETERS and SOAK_CASES (of fuzzing) make it smaller
soak: develop
	$(BIN)/python -m pytest -m soak -s test/soak

lint: develop
	$(BIN)/ruff check .
	$(BIN)/mypy

bench: develop
	$(BIN)/python -m benchmarks --json bench.json

docs: develop
	@$(BIN)/python docs/architecture_map.py
	@$(BIN)/python docs/json_schemas.py
	@$(BIN)/python docs/energy_terms.py
	@$(BIN)/python docs/reference_pages.py
	@$(BIN)/python -m scene_synth_ros layers --markdown > docs/layers.md

gallery: setup
	$(BIN)/python -m scene_synth_ros gallery --out docs/gallery

clean:
	rm -rf $(VENV) build install log
