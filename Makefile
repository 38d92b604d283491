# Everything a user or CI runs. Needs Python >= 3.11 (PYTHON=...) and make, nothing else.
PYTHON ?= python3
JOBS ?= 2
VENV := .venv
BIN := $(VENV)/bin
# processes that steal each other's tests; what several of them need is made once (tests/conftest.py)
PYTEST := -m pytest -n $(JOBS) --dist worksteal

.PHONY: demo docs validation test test-fast test-lowest lint types imports lock clean

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
	$(BIN)/python $(PYTEST)

# without what is marked `long`: less than two minutes, once the kernels are compiled
test-fast: $(VENV)/installed-dev
	$(BIN)/python $(PYTEST) -m "not long"

# the lower bounds of pyproject.toml, in an environment of their own, on what depends on versions: files, tables, input
# and commands (tests/unit), figures and pages among them, what the compiler makes of the kernels (tests/parity), and a
# cluster. Mechanics, with the same bits from the same kernels, is not tested twice. Another numba has its own cache.
test-lowest: $(VENV)-lowest/installed
	NUMBA_CACHE_DIR=$(CURDIR)/build/numba-lowest \
	$(VENV)-lowest/bin/python $(PYTEST) -m "versions or not long" \
	tests/architecture tests/unit tests/parity tests/end_to_end

lint: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/installed-dev
	$(BIN)/mypy

# who may import whom
imports: $(VENV)/installed-dev
	$(BIN)/lint-imports

lock: $(VENV)/installed-dev
	$(BIN)/python -m pip install -q uv
	$(BIN)/uv pip compile -q --generate-hashes --extra dev --universal pyproject.toml -o requirements-dev.lock
	$(BIN)/uv pip compile -q --generate-hashes --extra docs --universal pyproject.toml -o requirements-docs.lock

clean:
	rm -rf $(VENV) $(VENV)-docs $(VENV)-lowest demo build

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install -q --disable-pip-version-check -e .
	touch $@

$(VENV)/installed-dev: pyproject.toml requirements-dev.lock | $(VENV)/bin/python
	$(BIN)/python -m pip install -q --disable-pip-version-check --require-hashes -r requirements-dev.lock
	$(BIN)/python -m pip install -q --disable-pip-version-check --no-deps -e .
	touch $@ $(VENV)/installed

$(VENV)-docs/installed: pyproject.toml requirements-docs.lock
	$(PYTHON) -m venv $(VENV)-docs
	$(VENV)-docs/bin/python -m pip install -q --disable-pip-version-check --require-hashes -r requirements-docs.lock
	$(VENV)-docs/bin/python -m pip install -q --disable-pip-version-check --no-deps -e .
	touch $@

$(VENV)-lowest/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)-lowest
	$(VENV)-lowest/bin/python -m pip install -q --disable-pip-version-check uv
	$(VENV)-lowest/bin/uv pip install -q --python $(VENV)-lowest/bin/python --resolution lowest-direct -e ".[dev]"
	touch $@
