PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.DEFAULT_GOAL := help
.PHONY: help demo test quick soak check lint types more-types scripts english house docs site figures bench dist clean

help: ## list these commands
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

# What solving needs, and beside it what tests, checks and documentation need.
$(VENV)/solving: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

$(VENV)/ready: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	$(BIN)/python -m compileall -q __init__.py models nlp cases
	touch $@ $(VENV)/solving

demo: $(VENV)/solving ## set up what solving needs and solve the paper's Section 4.1
	$(BIN)/screwsynth solve paper-4.1-helical

test: $(VENV)/ready ## set everything up and run every test
	$(BIN)/python -P -m pytest --numprocesses auto --dist worksteal

quick: $(VENV)/ready ## run the fast tests only
	$(BIN)/python -P -m pytest --numprocesses auto --dist worksteal -m 'not slow and not soak'

soak: $(VENV)/ready ## run what make test leaves out: whole loops over robots, cases and units
	$(BIN)/python -P -m pytest --numprocesses auto --dist worksteal -m soak
	$(BIN)/python bench/soundness/units.py 120 0

# Type checkers cannot follow the editable install's hook, so they get the package under its name, without tests and docs.
build/typing/screwsynth: pyproject.toml
	mkdir -p $@
	ln -sfn $(addprefix ../../../,__init__.py __init__.pyi py.typed models nlp cases) $@
	touch $@

check: lint types more-types scripts english house ## check formatting, lint, types, import contracts and English; with --jobs 2 at once

lint: $(VENV)/ready
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports

types: $(VENV)/ready build/typing/screwsynth
	$(BIN)/mypy

more-types: $(VENV)/ready build/typing/screwsynth
	$(BIN)/basedpyright --level error

# Types of the JavaScript in pages, where npm can install the compiler.
scripts: $(VENV)/ready
	$(BIN)/python -P bench/scripts.py

# Descriptions that stand alone, short sentences in documents, words with a replacement.
english: $(VENV)/ready
	$(BIN)/python bench/english.py

# Sizes are for reading: whatever they are, the check goes on.
house: $(VENV)/ready
	@-$(BIN)/python bench/house.py

docs: $(VENV)/ready ## write the program's output into the documentation
	$(BIN)/python -P docs/gallery.py
	$(BIN)/python -P docs/pocket.py
	$(BIN)/python -P docs/circles.py
	$(BIN)/python -P docs/refresh.py
	$(BIN)/python -P docs/introductions.py
	$(BIN)/python -P docs/tour.py

# Once its packages are there, a build needs no network. It ends at the first warning.
site: $(VENV)/solving ## build the documentation as a site in build/site
	@$(BIN)/python -c 'import furo, matplotlib, myst_nb, plotly' 2>/dev/null || $(BIN)/python -m pip install --quiet --editable '.[docs]'
	$(BIN)/python -P -m sphinx --quiet --fail-on-warning --fresh-env --write-all docs build/site

figures: $(VENV)/ready ## draw the pictures of the documentation, that of a live page where Chromium is installed
	$(BIN)/python -P docs/figures.py
	$(BIN)/python -P docs/livepicture.py

# Where not all methods that are compared can be installed, each is tried by itself: the rows of a missing one say so.
PEERS := scipy nlopt cma pygmo pyscipopt maingopy
bench: $(VENV)/ready ## compare with other methods and write docs/benchmarks.md; BENCH=--quick for a short run
	@$(BIN)/python -P -c 'import scipy, nlopt, cma, pygmo, pyscipopt, maingopy' 2>/dev/null \
		|| $(BIN)/python -m pip install --quiet --editable '.[bench]' \
		|| for each in $(PEERS); do $(BIN)/python -m pip install --quiet $$each || echo "without $$each"; done
	$(BIN)/python bench/benchmark.py $(BENCH)

dist: $(VENV)/ready ## build the source distribution and a wheel from it, into dist
	$(BIN)/python -m build

clean: ## remove the environment and all build results
	rm -rf $(VENV) build dist *.egg-info nlp/proof/enclosure/_bounds*.so nlp/screening/_screen*.so .mypy_cache .ruff_cache .pytest_cache .import_linter_cache
