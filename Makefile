# make demo   set up everything, simulate the paper's brake and sweep its actuator's slope,
#             leave pictures and verdicts
# make test   set up everything, check the house rules, run the tests
# make test-portable  the numerical tests again, with the instruction sets of older processors
# make app    the explorer: a page where sliders move the machine
# make bench  speed and error of the package and its peers in one table, then each part's own
# make bench-docs  docs/benchmarks.md and docs/scale.md from what bench measured
# make lint   the house rules alone
# make slow   the studies of minutes
# make coverage  which lines the tests run, of the kernels as plain Python; fails below a floor
# make docs   the documentation as pages for a browser, in out/docs
# make paper  the audit of the source paper, with the copy in docs

PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
OUT := out
# Bytecode is written, so that modules are compiled once, not by each process that tests start.
export PYTHONDONTWRITEBYTECODE =

.PHONY: demo app test test-portable bench bench-docs lint slow coverage docs paper clean

$(VENV)/.demo: pyproject.toml
	@command -v $(PYTHON) >/dev/null || { echo "error: $(PYTHON) not found: install Python 3.11 or newer, or say make PYTHON=python3"; exit 2; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[netcdf]'
	touch $@

$(VENV)/.app: $(VENV)/.demo
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[app]'
	touch $@

$(VENV)/.dev: $(VENV)/.demo
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	touch $@

$(VENV)/.bench: $(VENV)/.dev
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[bench]'
	touch $@

demo: $(VENV)/.demo
	@mkdir -p $(OUT)
	$(BIN)/wedgebrake simulate examples/paper.toml --plot $(OUT)/paper.png --out $(OUT)/paper.nc
	$(BIN)/wedgebrake sweep examples/sweep.toml --plot $(OUT)/bifurcation.png

app: $(VENV)/.app
	$(BIN)/wedgebrake app

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The largest kernels are compiled first, beside lint: each of the two processes of pytest would
# compile them for itself.
test: $(VENV)/.dev
	$(BIN)/wedgebrake compile machines & machines=$$!; \
		{ $(MAKE) --no-print-directory lint && $(BIN)/wedgebrake compile drivelines smooth; } \
		|| { kill $$machines; exit 1; }; \
		wait $$machines
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "not slow"

# Excluded: tests without numerics, and the comparisons with other programs, which are slow.
NOT_PORTABLE := cli* *plot* paper* store* stud* bad* bench* cluster* compiling*
PORTABLE := tests/properties tests/literature tests/motion_truth tests/unit \
	$(NOT_PORTABLE:%=--ignore-glob='tests/unit/test_%')

# First NumPy without its AVX-512 and AVX2 loops and kernels without fused multiply-add. Then, on
# processors with AVX-512, NumPy without it only; the kernels are unchanged, so the tests that follow
# branches are left out.
test-portable: $(VENV)/.dev
	NPY_DISABLE_CPU_FEATURES="X86_V3 X86_V4" NUMBA_CPU_NAME=generic \
		$(BIN)/python -m pytest -n 2 --dist worksteal -m "not slow" $(PORTABLE)
	! grep -qs avx512f /proc/cpuinfo || NPY_DISABLE_CPU_FEATURES="X86_V4" \
		$(BIN)/python -m pytest -n 2 --dist worksteal -m "not slow" $(PORTABLE) \
		--ignore-glob='tests/unit/test_codim2*' --ignore-glob='tests/unit/test_branches*'

slow: $(VENV)/.bench
	$(BIN)/python -m pytest -m slow

bench: $(VENV)/.bench
	$(BIN)/python benchmarks/run.py
	$(BIN)/python benchmarks/scale.py
	$(BIN)/python benchmarks/sweeps.py
	$(BIN)/python benchmarks/paper.py
	$(BIN)/python benchmarks/orbits.py
	$(BIN)/python benchmarks/fitting.py
	$(BIN)/python benchmarks/machines.py
	$(BIN)/python benchmarks/harmonics.py
	$(BIN)/python benchmarks/sensitivity.py
	$(BIN)/python benchmarks/explorer.py
	$(BIN)/python benchmarks/page_loads.py

bench-docs: $(VENV)/.bench
	$(BIN)/python benchmarks/run.py --write-docs
	$(BIN)/python benchmarks/scale.py --write-docs

coverage: $(VENV)/.dev
	$(BIN)/coverage erase
	$(BIN)/coverage run tests/release/interpreted.py --plain >/dev/null
	$(BIN)/coverage run -m pytest -m "not slow"
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report --include='*/dynamics/*,*/solvers/event_driven/*,*/solvers/smooth/*' --fail-under=90
	$(BIN)/coverage report --skip-covered

docs: $(VENV)/.dev
	$(BIN)/python -m sphinx -W --keep-going docs $(OUT)/docs
	@echo "Documentation: $(OUT)/docs/index.html"

paper: $(VENV)/.demo
	@mkdir -p $(OUT)
	$(BIN)/wedgebrake paper all --out $(OUT)/paper
	cp $(OUT)/paper/report.html docs/paper.html
	cp $(OUT)/paper/fig11.png docs/paper.png

clean:
	rm -rf $(VENV) $(OUT) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find src tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +
