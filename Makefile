# Two commands for a newcomer: `make demo` shows what it does, `make test` shows that it works.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
DEMO ?= data/demo-$(shell date +%Y%m%d-%H%M%S)
MINUTES ?= 60

.PHONY: demo test fuzz bench images contact-sheet statistics paper clean

demo: $(VENV)/.installed
	@$(BIN)/run-protocol chest.yaml --simulate 8 --seed 1 --data $(DEMO)
	@$(BIN)/autd-trials analyse $(DEMO)/chest

test: $(VENV)/.installed-for-tests
	@tests/system-packages
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/pytest --numprocesses 3 --dist loadfile

# Every property over new random examples, round after round, and mutated files through the commands.
fuzz: $(VENV)/.installed-for-tests
	@tests/system-packages
	$(BIN)/python tests/fuzz/run.py --minutes $(MINUTES)

bench: $(VENV)/.installed-for-tests
	@for script in tests/benchmarks/bench_*.py; do echo "== $$script"; $(BIN)/python $$script || exit 1; done

images: $(VENV)/.installed
	$(BIN)/python docs/make_images.py

# Figures of made-up studies of every size, width and script, to be looked at: build/contact-sheet (six minutes).
contact-sheet: $(VENV)/.installed
	$(BIN)/python docs/make_contact_sheet.py

# Both simulate for a while: the tables of docs/statistics.md (half an hour) and docs/paper.md (a minute).
statistics: $(VENV)/.installed
	$(BIN)/python docs/make_statistics.py

paper: $(VENV)/.installed
	$(BIN)/python docs/make_paper.py

clean:
	rm -rf $(VENV) build *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis .import_linter_cache

$(VENV)/bin/pip:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or newer is needed: make PYTHON=python3.11 ..."; exit 2; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: pyproject.toml constraints.txt | $(VENV)/bin/pip
	$(BIN)/pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable .
	@touch $@

$(VENV)/.installed-for-tests: $(VENV)/.installed
	$(BIN)/pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[test]'
	@touch $@
