# Everything a fresh machine needs: `make paper` and `make test` set up .venv themselves.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= report
QUALITY ?= paper

# The processes that tests start load byte code, also where the environment says that none is to be written.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: paper test lint bench mutation clean

$(VENV)/.installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable .
	touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable ".[test]"
	touch $@

# With python-flint, which proves the periodic motions.
$(VENV)/.installed-proof: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable ".[proof]"
	touch $@

paper: $(VENV)/.installed-proof
	$(BIN)/gearchaos paper --quality $(QUALITY) --out $(OUT)

lint: $(VENV)/.installed-test
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# Source distribution and wheel; what the wheel installs is tried in an empty environment by try-wheel.
.PHONY: dist try-wheel try-wheel-slow
dist: $(VENV)/.installed-test
	rm -rf dist
	$(BIN)/python -m hatchling build -d dist

try-wheel: dist
	$(BIN)/python -m tests.wheel dist

# The commands that take minutes: all kernels, the report of the paper.
try-wheel-slow: dist
	$(BIN)/python -m tests.wheel dist --slow

$(VENV)/.installed-docs: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable ".[docs]"
	touch $@

# The manual, in build/docs. Tutorials and gallery are run; a second build runs only those that changed.
.PHONY: docs
docs: $(VENV)/.installed-docs
	$(MAKE) kernels
	$(BIN)/python -m sphinx -b html -W --keep-going -q -j 2 docs build/docs
	$(BIN)/python docs/_ext/check_site.py build/docs

# The browser of the explorer's tests.
SUDO := $(if $(filter 0,$(shell id -u)),,sudo)
.PHONY: chromium
chromium:
	command -v chromium || command -v chromium-browser \
		|| ($(SUDO) apt-get update -q && $(SUDO) apt-get install -y -q --no-install-recommends chromium)

# Kernels that most tests need, compiled side by side before them; the others are compiled by the tests that need them.
.PHONY: kernels
kernels: $(VENV)/.installed
	$(BIN)/python -c "from gearchaos.studies.core.warmup import warmup; print(*warmup((2, 4)), sep='\n')"

# --dist loadfile keeps the tests of a file in one process, or those of several files that share servers, stores and the
# browser: tests/conftest.py. Three processes on two cores: that of the browser mostly waits.
test: $(VENV)/.installed-test
	$(MAKE) --jobs=3 --output-sync=target kernels lint chromium
	$(BIN)/python -m pytest -n 3 --dist loadfile

# What a change reaches: what differs from the commit SINCE, by default from the last one.
.PHONY: quick slow oracles
SINCE ?= HEAD
quick: $(VENV)/.installed-test
	$(BIN)/python -m pytest -m "not slow" -n 2 --dist loadfile --reached $(SINCE) --within 90

slow: $(VENV)/.installed-test try-wheel-slow
	$(BIN)/python -m pytest -m exhaustive -n 2
	GEARCHAOS_ORACLES=anew $(BIN)/python -m pytest -n 2 $(ORACLES)

# The stored results of the oracles, integrated and written anew: when an oracle, or what is asked of it, has changed.
ORACLES := $(shell grep -rlE "tests.oracles.*(oracle|_trains|_teeth|_contacts)" tests --include="test_*.py")
oracles: $(VENV)/.installed-test
	GEARCHAOS_ORACLES=write $(BIN)/python -m pytest $(ORACLES)

$(VENV)/.installed-bench: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable ".[bench]"
	touch $@

bench: $(VENV)/.installed-bench
	$(BIN)/python benchmarks/throughput.py --json bench.json --plot bench.png
	$(BIN)/python benchmarks/several_contacts.py
	$(BIN)/python benchmarks/limit.py
	$(BIN)/python benchmarks/exactness.py

$(VENV)/.installed-mutation: $(VENV)/.installed-test
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable ".[mutation]"
	touch $@

# Goes on where it was stopped; the results are in build/mutation.
MUTANTS ?= 320
SEED ?= 1
mutation: $(VENV)/.installed-mutation
	$(BIN)/python -m tests.mutation --count $(MUTANTS) --seed $(SEED)

clean:
	rm -rf $(VENV) $(OUT) dist build/docs build/docs-notebooks docs/generated
