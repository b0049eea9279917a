# Everything a user or a build server runs. `make help` lists it.
PYTHON ?= python3
BUDGET ?= standard
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

# gmsh and VTK link against these; wheels do not carry them.
LIBRARIES := libGLU.so.1 libGL.so.1 libEGL.so.1 libXrender.so.1 libXcursor.so.1 libXft.so.2 libXinerama.so.1 libgomp.so.1
PACKAGES := libglu1-mesa libgl1 libegl1 libxrender1 libxcursor1 libxft2 libxinerama1 libgomp1

.PHONY: help setup system browser cantilever bench hard-cases integration plate-drop tire same test test-slow check lint clean

help: ## show this list
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*##/\t/' | expand -t 14

setup: system $(READY) ## make .venv with the pinned dependencies

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Groovecheck needs Python 3.11 or newer; set PYTHON=/path/to/python3.11"; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
	@touch $@

system:
	@missing=; for library in $(LIBRARIES); do /sbin/ldconfig -p 2>/dev/null | grep -qF $$library || missing="$$missing $$library"; done; \
	if [ -z "$$missing" ]; then exit 0; fi; \
	echo "System libraries missing:$$missing"; \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $(PACKAGES) >/dev/null; \
	else \
	  echo "On Debian or Ubuntu: sudo apt-get install --no-install-recommends $(PACKAGES)"; \
	  echo "Without them gmsh cannot mesh the reference and no pictures are drawn; the ANCF solver still runs."; \
	fi

browser:
	@command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null || \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium >/dev/null; \
	else \
	  echo "No Chromium: the tests that open the page in a browser are skipped (Debian package: chromium)"; \
	fi

cantilever: setup ## the cantilever table and its page; BUDGET=quick|standard|full
	$(BIN)/groovecheck run cantilever --budget $(BUDGET) $(if $(filter quick,$(BUDGET)),,--timed)

bench: setup ## what both solvers cost, reports/build/speed.html; BUDGET=quick|standard|full
	$(BIN)/python -m reports.speed --budget $(BUDGET)

hard-cases: setup ## where elements, steps and solvers break, reports/build/hard_cases.html; BUDGET=quick|standard|full
	$(BIN)/python -m reports.hard_cases --budget $(BUDGET)

integration: setup ## rules over grooves of any outline and over treads, reports/build/integration.html; BUDGET=quick|standard|full
	$(BIN)/python -m reports.integration --budget $(BUDGET)

plate-drop: setup ## the grooved plate on the ground, reports/build/plate_drop.html; BUDGET=quick|standard|full
	$(BIN)/python -m reports.plate_drop --budget $(BUDGET)

tire: setup ## the tire with four grooves on the ground, reports/build/tire.html; BUDGET=quick|standard|full
	$(BIN)/python -m reports.tire --budget $(BUDGET)

same: setup ## the cantilever through Snakemake equals a plain run, bit for bit; BUDGET=quick|standard|full
	$(BIN)/python -c 'import snakemake' 2>/dev/null || $(BIN)/python -m pip install --quiet --disable-pip-version-check 'snakemake>=9'
	$(BIN)/python workflow/same.py cantilever $(BUDGET)

check: setup ## compare fresh quick runs of cantilever, hard cases, integration, plate drop with the accepted tables
	$(BIN)/groovecheck check cantilever --fresh
	$(BIN)/python -m reports.hard_cases --budget quick --check --fresh
	$(BIN)/python -m reports.integration --budget quick --check --fresh
	$(BIN)/python -m reports.plate_drop --budget quick --check --fresh

# The tests start hundreds of processes, which share compiled modules, also where the environment forbids to keep them.
test: setup browser ## the test suite, within 5 minutes on two cores
	PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2

test-slow: setup browser ## the long studies too
	PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 -m "slow or not slow"

lint: setup ## ruff
	$(BIN)/ruff check . && $(BIN)/ruff format --check .

clean: ## remove results and pages; keep the environment
	rm -rf reports/build
