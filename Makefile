# Two commands need nothing before them but Python 3.11+, git and make: `make reproduce` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
CORE := $(VENV)/core
READY := $(VENV)/ready
DOCS := $(VENV)/docs
PEERS := .venv-peers
PIP := -m pip --disable-pip-version-check

# The environment here is the project's own: its modules are compiled once, however Python is set up elsewhere.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup reproduce test test-proofs thorough durations challenge firmware fuzz lint types proofs bench bench-peers golden errata docs release frontend clean

help:
	@echo "make reproduce  fly the paper's study and write out/paper/"
	@echo "make test       run the tests; some: make test TESTS='tests/test_cli.py -x'"
	@echo "make test-proofs  run the tests of rooms that prove things or judge the paper (prove, theory, certify, verify), and try mutants of every law"
	@echo "make thorough   run the cases that make test leaves out: all of every product of laws, vehicles, terminals, processors"
	@echo "make challenge  search for flights, files and data that contradict a verdict: SECONDS=3600, SEED=7, ONLY='tubes'"
	@echo "make firmware   fly under your autopilots' trees, build exports in them: QUADSTEP_PX4=DIR QUADSTEP_ARDUPILOT=DIR QUADSTEP_CRAZYFLIE=DIR ONLY='circle'"
	@echo "make fuzz       try 100,000 spoilt files: each is read, or refused with one clean line"
	@echo "make lint types check style and types"
	@echo "make proofs     prove the statements of docs/theory.md with Coq and Gappa; installs them (Debian, 370 MB) if need be"
	@echo "make bench      speed and memory, accuracy beside them"
	@echo "make bench-peers  the same beside other simulators, installed into $(PEERS)"
	@echo "make golden     accept the present results of the study as the committed ones"
	@echo "make errata     write docs/errata.md from the rows of quadstep verify"
	@echo "make docs       run every listing of the documentation and build its site; one page: make docs PAGES=docs/ci.md"
	@echo "make release    build wheel and sdist into dist/, install each extra into a new environment and try it"
	@echo "make frontend   rebuild the page that ships with the package; needs Node.js 20 or newer"

setup: $(READY)

# Installs a lock file into .venv: only what is missing or has another version there. What an interrupted pip left half
# unpacked has no INSTALLER yet and is installed again. $(1): the lock file.
define install
	@for dist in $(VENV)/lib/python3*/site-packages/*.dist-info; do test -e "$$dist/INSTALLER" || rm -rf "$$dist"; done
	@$(BIN)/python $(PIP) install $$(test -t 1 || echo --quiet) --no-compile --no-warn-conflicts --only-binary :all: --require-hashes -r $(1)
endef

# An environment with the pinned pip. Python's own way to put pip there is three times slower, but needs no pip to begin with.
define environment
echo "Making $(VENV)/ with `$(PYTHON) --version`"; \
	$(PYTHON) -m venv --clear --without-pip $(VENV) && \
	$(PYTHON) $(PIP) --python $(BIN)/python install --quiet --no-compile --require-hashes -r requirements/pip.lock 2>/dev/null || \
	$(PYTHON) -m venv --clear $(VENV)
endef

# The core: what flying, judging and drawing need.
$(CORE): requirements/core.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "quadstep needs Python 3.11 or newer; this is `$(PYTHON) --version`. Name another: make PYTHON=python3.12"; exit 2; }
	@test -x $(BIN)/pip && $(BIN)/python -c '' || { $(environment); }
	@echo "Installing the core into $(VENV)/: NumPy, LLVM, Matplotlib and others, 106 MB to download, 350 MB on disk, 20 s on a fast network"
	$(call install,requirements/core.lock)
	@$(BIN)/python $(PIP) install --quiet --no-compile --no-deps --no-build-isolation -e .
	@touch $@

# And what tests, types and benchmarks need besides.
$(READY): $(CORE) requirements/dev.lock
	@echo "Installing what tests and benchmarks need besides into $(VENV)/: Ray, MuJoCo, SciPy, PyArrow, Playwright and others, 375 MB to download, 1.1 GB on disk, a minute on a fast network"
	$(call install,requirements/dev.lock)
	@touch $@

# And what the site of the documentation needs besides.
$(DOCS): $(READY) requirements/docs.lock
	@echo "Installing what the documentation needs besides into $(VENV)/: Sphinx, its Markdown and its theme, 9 MB to download"
	$(call install,requirements/docs.lock)
	@touch $@

reproduce: $(CORE)
	$(BIN)/quadstep reproduce

test: $(READY)
	$(BIN)/python -m pytest -n 3 --dist loadfile --no-loadscope-reorder --proofs-apart $(TESTS)

test-proofs: $(READY)
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m proofs $(TESTS)

thorough: $(READY)
	$(BIN)/python -m pytest -n 2 --dist worksteal --thorough -m thorough $(TESTS)

durations: $(READY)
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder --record-durations $(TESTS)

SECONDS ?= 300

challenge: $(READY)
	$(BIN)/python -m tests.challenge --seconds $(SECONDS) $(if $(SEED),--seed $(SEED)) $(if $(ONLY),--only '$(ONLY)')

# Trees are named by QUADSTEP_PX4, QUADSTEP_ARDUPILOT, QUADSTEP_CRAZYFLIE, in the environment or here; nothing is fetched.
# ONLY: what the names of rows of its table match, such as 'px4: circle'.
export QUADSTEP_PX4 QUADSTEP_ARDUPILOT QUADSTEP_CRAZYFLIE ONLY
firmware: $(READY)
	@$(BIN)/python -m tests.firmware_flights

fuzz: $(READY)
	$(BIN)/python -m tests.fuzz

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python -m pytest -q -p no:cacheprovider tests/test_structure.py -k "order or rooms or circle"

types: $(READY)
	$(BIN)/mypy

PROVERS := coq libcoq-stdlib gappa

proofs: $(READY)
	@command -v coqc >/dev/null && command -v gappa >/dev/null || { \
		command -v apt-get >/dev/null || { echo "make proofs needs Coq 8.16 or newer and Gappa, and there is no apt-get to install them with"; exit 2; }; \
		echo "Installing $(PROVERS)"; \
		as_root=$$(test "$$(id -u)" = 0 || echo sudo -n); \
		$$as_root apt-get update -qq && \
		$$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $(PROVERS) >/dev/null; }
	$(BIN)/python -m proofs

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
	$(BIN)/python -m quadstep.proofs.verify.registry

docs: $(DOCS)
	$(BIN)/python -m docs.site $(PAGES)

release: $(READY)
	$(BIN)/python -m benchmarks.release

frontend:
	@command -v npm >/dev/null || { echo "make frontend needs Node.js 20 or newer with npm"; exit 2; }
	cd frontend && npm ci --silent && npm run --silent check && npm run --silent build

clean:
	rm -rf $(VENV) $(PEERS) out
