# Two commands need nothing before them but Python 3.11+, git and make: `make reproduce` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/ready
PEERS := .venv-peers

.PHONY: help setup reproduce test lint types bench bench-peers golden errata frontend clean

help:
	@echo "make reproduce  fly the paper's study and write out/paper/"
	@echo "make test       run all tests"
	@echo "make lint types check style and types"
	@echo "make bench      speed and memory, accuracy beside them"
	@echo "make bench-peers  the same beside other simulators, installed into $(PEERS)"
	@echo "make golden     accept the present results of the study as the committed ones"
	@echo "make errata     write docs/errata.md from the rows of quadstep verify"
	@echo "make frontend   rebuild the page that ships with the package; needs Node.js 20 or newer"

setup: $(READY)

$(READY): requirements/dev.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "quadstep needs Python 3.11 or newer; this is `$(PYTHON) --version`. Name another: make PYTHON=python3.12"; exit 2; }
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/dev.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

reproduce: $(READY)
	$(BIN)/quadstep reproduce

test: $(READY)
	$(BIN)/python -m pytest -n 2 --dist loadfile

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY)
	$(BIN)/mypy

bench: $(READY)
	$(BIN)/python -m benchmarks

bench-peers: $(PEERS)/ready bench

$(PEERS)/ready: requirements/peers.lock requirements/peers-torch.lock
	$(PYTHON) -m venv --clear $(PEERS)
	$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r requirements/peers.lock
	$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r requirements/peers-torch.lock || echo "No PyTorch for processors where pip looks: RotorPy is measured without its batch."
	@touch $@

golden: $(READY)
	$(BIN)/python -m tests.golden

errata: $(READY)
	$(BIN)/python -m quadstep.verify.errata

frontend:
	@command -v npm >/dev/null || { echo "make frontend needs Node.js 20 or newer with npm"; exit 2; }
	cd frontend && npm ci --silent && npm run --silent check && npm run --silent build

clean:
	rm -rf $(VENV) $(PEERS) out
