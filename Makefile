# gradient-routes: `make` lists what there is
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/ready
GATE := results/gate.sqlite
REPORTED := $(if $(wildcard results/routes.sqlite),results/routes.sqlite,results/reference.sqlite)
# small problems, not timed: counts, errors and verdicts are exact, and time is another gate's
MATRIX := --problem bar --problem 'block[n=2]' --problem 'advection[n=4]' --route all --no-timing --jobs 2
DEFAULT := --problem 'bar[n=8|100|1000|10000|100000|1000000]' --problem 'block[n=4|6|8]' --problem 'advection[n=8|16|32]'
CHECKED := adjoint faulty-adjoint
TESTED ?= tests/test_api.py tests/test_cli.py tests/problems/test_problems.py tests/routes/test_factorization.py

.DEFAULT_GOAL := help
.PHONY: help demo measured test test-pythons lint type gate baseline adapters adapters-all benchmark benchmark-regression benchmark-baseline faults mutants reports reference docs vega clean

help: ## list these targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 24

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "make: $(PYTHON) is older than 3.11 - name a newer one: make PYTHON=python3.11"; exit 1; }
	@echo "installing into .venv, about a minute"
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

demo: $(READY) ## install into .venv, then all seven routes on the bar
	$(BIN)/routes run --problem bar --route all

STEEL = plate[body=hole,nx=16,ny=4,size=0.08,0.02,radius=0.004,element=quad8,law=linear,unknown=constants,constants=E,nu,clamped=left,loaded=right,direction=normal,traction=106.2629e6,data=examples/measured/steel_plate.csv,noise=0.4um

RUBBER = data=examples/measured/rubber.csv,noise=5kPa
ROD = rod[data=examples/measured/cooled_rod.csv,length=400mm,diameter=12mm,conductivity=110,base=85degC,ambient=21.5degC,noise=0.1K
WALL = heat[data=examples/measured/heated_wall.csv,noise=0.2K,size=100mm,n=10,ny=1,exposed=right,density=2300,heat_capacity=880,ambient=20degC,base=60degC,initial=20degC,unknown=diffusivity+film

measured: $(READY) ## measurements to constants, wrong models flagged: a published steel plate, rubber curves to a block, a cooled rod, a heated wall
	-$(BIN)/routes invert --problem '$(STEEL)]' --optimizer gauss-newton --no-plot
	$(BIN)/routes invert --problem '$(STEEL),motion=rigid]' --optimizer gauss-newton --no-plot
	$(BIN)/routes identify --problem 'coupon[law=yeoh,$(RUBBER)]' --no-plot
	-for law in neo-hookean mooney-rivlin ogden; do $(BIN)/routes invert --problem "coupon[law=$$law,$(RUBBER)]" --optimizer gauss-newton --no-plot; done
	$(BIN)/routes invert --problem 'coupon[law=yeoh,$(RUBBER)]' --optimizer gauss-newton --no-plot -o results/rubber_constants.csv
	$(BIN)/routes run --problem 'block[law=yeoh,nu=0.49,unknown=constants,traction=2e5]' --at results/rubber_constants.csv --route adjoint --vtu results/rubber_block.vtu
	$(BIN)/routes identify --problem '$(ROD),parts=2]' --no-plot
	-$(BIN)/routes invert --problem '$(ROD)]' --no-plot
	$(BIN)/routes invert --problem '$(ROD),parts=2]' --no-plot
	-$(BIN)/routes invert --problem '$(WALL),steps=31,dt=10min]' --optimizer gauss-newton --no-plot
	$(BIN)/routes invert --problem '$(WALL),steps=151,dt=2min,scheme=crank-nicolson]' --optimizer gauss-newton --no-plot
	$(BIN)/routes report -o results/report.html

test: $(READY) ## install into .venv, then the tests
	$(BIN)/python -m pytest -n 3 --dist worksteal

test-pythons: ## all routes on the bar, and some tests, on the oldest Python 3.11, 3.12 and 3.13 installed
	python3 .ci/pythons.py $(TESTED)

lint: $(READY) ## style: ruff
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

type: $(READY) ## types: mypy
	$(BIN)/mypy

define MEASURE # what fails is for the comparison to judge
@rm -f $(GATE)
$(BIN)/routes run $(MATRIX) --store $(GATE) >/dev/null || [ $$? -eq 1 ]
for route in $(CHECKED); do \
  $(BIN)/routes check --problem bar --route $$route --no-plot --store $(GATE) >/dev/null || [ $$? -ne 2 ] || exit 2; \
done
endef

gate: $(READY) ## counts, errors and verdicts of a small matrix against results/baseline.json
	$(MEASURE)
	@mkdir -p .benchmarks
	@$(BIN)/routes compare results/baseline.json $(GATE) -o .benchmarks/gate.md >/dev/null || true
	$(BIN)/routes compare results/baseline.json $(GATE)

baseline: $(READY) ## results/baseline.json anew: look at its diff
	$(MEASURE)
	$(BIN)/routes baseline --store $(GATE)

benchmark-regression: $(READY) ## kernels and routes timed against tests/benchmarks/baseline.json
	$(BIN)/python tests/benchmarks/gate.py $(FORM)

benchmark-baseline: $(READY) ## tests/benchmarks/baseline.json anew: look at its diff
	$(BIN)/python tests/benchmarks/gate.py --write

benchmark: $(READY) ## the default matrix into results/, with resume, then scaling, limits, verdicts (half an hour)
	$(BIN)/routes run $(DEFAULT) --route all --resume
	$(BIN)/routes scaling --problem bar --no-plot
	$(BIN)/routes scaling --problem block --route tangent --route adjoint --route fd-central --growth 2 --no-plot
	$(BIN)/routes scaling --problem advection --route tangent --route adjoint --no-plot
	$(BIN)/python -m benchmarks.bar_limits
	$(BIN)/python -m benchmarks.block_limits
	$(BIN)/python -m benchmarks.verdicts
	$(BIN)/python -m benchmarks.confusion
	$(BIN)/python -m benchmarks.harness
	$(BIN)/python -m benchmarks.repeat
	$(BIN)/python -m benchmarks.reporting
	$(BIN)/python -m benchmarks.large
	$(BIN)/python -m benchmarks.loads
	$(BIN)/python -m benchmarks.intervals
	$(BIN)/python -m benchmarks.starts
	$(BIN)/python -m benchmarks.data_files
	$(BIN)/python -m benchmarks.error_bars
	$(BIN)/python -m benchmarks.adapter_overhead
	$(BIN)/python -m benchmarks.march
	$(BIN)/python -m benchmarks.laboratory

adapters: $(READY) ## environments of Taichi, Warp, torch-fem and C, with which the tests run their adapters (2.5 GB)
	$(BIN)/routes environments create --missing taichi warp torch-fem executable

adapters-all: $(READY) ## environments of all frameworks (9 GB), then their comparison, results/frameworks.md, where it is missing
	$(BIN)/routes environments create --missing all
	$(BIN)/python -m benchmarks.frameworks $(if $(AGAIN),--again)

faults: $(READY) ## 300 kills, full disks and read-only stores at random points of sweeps: is anything lost? (half an hour)
	$(BIN)/python -m benchmarks.faults

mutants: $(READY) ## 60 small faults in problems, routes and the judge: do the tests fail? (hours)
	$(BIN)/python -m benchmarks.mutants

reports: $(READY) ## everything in results/ as one page, results/report.html; of the reference run where there is no other
	$(BIN)/routes report --store $(REPORTED) -o results/report.html

reference: $(READY) ## the small reference run that is committed, anew
	$(BIN)/python -m benchmarks.reference_run

docs: $(READY) ## the documentation as a site, docs/_build/index.html
	$(BIN)/sphinx-build --quiet --fail-on-warning --keep-going docs docs/_build

vega: $(READY) ## the library that draws in pages anew, from the vl-convert of constraints.txt
	$(BIN)/python -c 'import gzip, vl_convert; open("bench/render/vega.js.gz", "wb").write(gzip.compress(vl_convert.javascript_bundle().encode(), 9, mtime=0))'

clean: ## remove what was installed, built and cached; keep results/
	rm -rf .venv .venvs build dist docs/_build docs/reference *.egg-info .mypy_cache .ruff_cache .pytest_cache .benchmarks
	find . -name __pycache__ -type d -exec rm -rf {} +
