# Everything a user or CI runs. Needs Python >= 3.11 (PYTHON=...) and make, nothing else.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test test-fast test-lowest lint types lock clean

demo: $(VENV)/installed
	$(BIN)/rendulic reproduce --preset quick -o demo

test: $(VENV)/installed-dev
	$(BIN)/python -m pytest

test-fast: $(VENV)/installed-dev
	$(BIN)/python -m pytest -m "not long"

# the lower bounds of pyproject.toml, in an environment of their own
test-lowest: $(VENV)-lowest/installed
	$(VENV)-lowest/bin/python -m pytest -m "not long"

lint: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/installed-dev
	$(BIN)/mypy

lock: $(VENV)/installed-dev
	$(BIN)/python -m pip install -q uv
	$(BIN)/uv pip compile -q --extra dev --universal pyproject.toml -o requirements-dev.lock

clean:
	rm -rf $(VENV) $(VENV)-lowest demo

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install -q --disable-pip-version-check -e .
	touch $@

$(VENV)/installed-dev: pyproject.toml requirements-dev.lock | $(VENV)/bin/python
	$(BIN)/python -m pip install -q --disable-pip-version-check -r requirements-dev.lock
	$(BIN)/python -m pip install -q --disable-pip-version-check --no-deps -e .
	touch $@ $(VENV)/installed

$(VENV)-lowest/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)-lowest
	$(VENV)-lowest/bin/python -m pip install -q --disable-pip-version-check uv
	$(VENV)-lowest/bin/uv pip install -q --python $(VENV)-lowest/bin/python --resolution lowest-direct -e ".[dev]"
	touch $@
