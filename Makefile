# gradient-routes: `make` lists what there is
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/ready

.DEFAULT_GOAL := help
.PHONY: help demo test lint type benchmark reports clean

help: ## list these targets
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 12

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "make: $(PYTHON) is older than 3.11 - name a newer one: make PYTHON=python3.11"; exit 1; }
	@echo "installing into .venv, about a minute"
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

demo: $(READY) ## install into .venv, then all seven routes on the bar
	$(BIN)/routes run --problem bar --route all

test: $(READY) ## install into .venv, then the tests
	$(BIN)/python -m pytest -n 2 --dist worksteal

lint: $(READY) ## style: ruff
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

type: $(READY) ## types: mypy
	$(BIN)/mypy

benchmark: $(READY) ## the bar over N and routes into results/, kernels, limits, verdicts, kills (minutes)
	$(BIN)/routes run --problem 'bar[n=8|100|1000|10000|100000|1000000]' --route all
	$(BIN)/python -m pytest tests/benchmarks/bench_*.py --benchmark-only --benchmark-columns=min,median,iqr,rounds
	$(BIN)/python -m bench.studies.limits
	$(BIN)/python -m bench.studies.block_limits
	$(BIN)/python -m bench.studies.verdicts
	$(BIN)/python -m bench.studies.confusion
	$(BIN)/python -m bench.studies.killing

reports: $(READY) ## the tables of everything in results/
	$(BIN)/routes report

clean: ## remove what was installed, built and cached; keep results/
	rm -rf .venv build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .benchmarks
	find . -name __pycache__ -type d -exec rm -rf {} +
