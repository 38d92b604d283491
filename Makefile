# Everything a user or CI runs. Needs Python >= 3.11 (PYTHON=...) and make, nothing else.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo docs validation test test-fast test-lowest lint types lock clean

demo: $(VENV)/installed
	$(BIN)/rendulic reproduce --preset quick -o demo

# the site of the documentation, any warning an error; runs the examples: some minutes the first time
docs: $(VENV)-docs/installed
	NO_MKDOCS_2_WARNING=1 $(VENV)-docs/bin/python -m mkdocs build --strict -q
	@echo "the documentation is in build/site/index.html"

# the table of docs/validation.md, from real runs
validation: $(VENV)/installed-dev
	$(BIN)/python docs/hooks/validation.py

test: $(VENV)/installed-dev
	$(BIN)/python -m pytest

test-fast: $(VENV)/installed-dev
	$(BIN)/python -m pytest -m "not long"

# the lower bounds of pyproject.toml, in an environment of their own; physics that takes its time is the same in both
test-lowest: $(VENV)-lowest/installed
	$(VENV)-lowest/bin/python -m pytest -m "not long" tests/architecture tests/unit tests/parity tests/invariants

lint: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/installed-dev
	$(BIN)/mypy

lock: $(VENV)/installed-dev
	$(BIN)/python -m pip install -q uv
	$(BIN)/uv pip compile -q --extra dev --universal pyproject.toml -o requirements-dev.lock
	$(BIN)/uv pip compile -q --extra docs --universal pyproject.toml -o requirements-docs.lock

clean:
	rm -rf $(VENV) $(VENV)-docs $(VENV)-lowest demo build

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install -q --disable-pip-version-check -e .
	touch $@

$(VENV)/installed-dev: pyproject.toml requirements-dev.lock | $(VENV)/bin/python
	$(BIN)/python -m pip install -q --disable-pip-version-check -r requirements-dev.lock
	$(BIN)/python -m pip install -q --disable-pip-version-check --no-deps -e .
	touch $@ $(VENV)/installed

$(VENV)-docs/installed: pyproject.toml requirements-docs.lock
	$(PYTHON) -m venv $(VENV)-docs
	$(VENV)-docs/bin/python -m pip install -q --disable-pip-version-check -r requirements-docs.lock
	$(VENV)-docs/bin/python -m pip install -q --disable-pip-version-check --no-deps -e .
	touch $@

$(VENV)-lowest/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)-lowest
	$(VENV)-lowest/bin/python -m pip install -q --disable-pip-version-check uv
	$(VENV)-lowest/bin/uv pip install -q --python $(VENV)-lowest/bin/python --resolution lowest-direct -e ".[dev]"
	touch $@
