"""What tests share: the zoo of problems and routes they multiply, and the command line as a function."""

from __future__ import annotations

import compileall
import gc
import os
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

# what one test compiles the next loads, commands in processes of their own included; before JAX is imported
ROOT = Path(__file__).parent.parent
CACHE = ROOT / ".pytest_cache" / "jax"
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(CACHE))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
os.environ.setdefault("JAX_TRACEBACK_IN_LOCATIONS_LIMIT", "0")  # a tenth of what tracing takes
# tests compile more than they compute: no optimization, the emitters that compile in two thirds of the time, and no
# parts for many cores, which save another quarter; newer versions of jaxlib end the process at a flag they do not know
KNOWN = " --xla_cpu_use_fusion_emitters=false --xla_cpu_parallel_codegen_split_count=1"
os.environ.setdefault(
    "XLA_FLAGS", f"--xla_backend_optimization_level=0{KNOWN if version('jaxlib').startswith('0.10.') else ''}"
)

# one worker is one thread: more than processors wait for each other in loops, small matrices take five times as long
for pool in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(pool, "1")

# where Python is to write no bytecode, hundreds of processes would compile the package anew
if sys.dont_write_bytecode and "PYTEST_XDIST_WORKER" not in os.environ:
    for folder in ("gradient_routes", "bench", "routes", "problems"):
        compileall.compile_dir(ROOT / folder, quiet=2)

os.environ.pop("COLUMNS", None)  # tables are as wide as in a pipe, not as the terminal of who runs the tests

gc.set_threshold(50_000)  # what JAX traces lives on: looking through it at every 700 objects finds nothing
collect = gc.collect


def collect_once(generation: int = 2) -> int:
    """Measurements collect garbage first: in all that JAX compiled for earlier tests, time and again, a tenth of what
    tests take. What is left over once is not looked through again.
    """
    found = collect(generation)
    gc.freeze()
    return found


gc.collect = collect_once

import numpy as np
import pytest
from click.testing import CliRunner
from commands import Ran, Shell
from duffing.problem import Duffing
from forks import Forks

from gradient_routes.bench.cli import main
from gradient_routes.problems.advection import Advection
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.problems.rod import Rod
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.finite_difference import fd_central, fd_one_sided
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.route import Route
from gradient_routes.routes.synthetic_data import with_synthetic_data
from gradient_routes.routes.tangent import tangent
from gradient_routes.routes.unrolled_ad import unrolled_ad

EXACT = (tangent, adjoint, complex_step, implicit_ad)
ROUTES = (fd_one_sided, fd_central, *EXACT, unrolled_ad)
EVERY_FACTORS = [{"factors": f} for f in ("refined", "fresh")]
OPTIONS = {
    "tangent": EVERY_FACTORS,
    "adjoint": [*EVERY_FACTORS, *(options | {"correct": "yes"} for options in EVERY_FACTORS)],
    "implicit-ad": EVERY_FACTORS,
    "fd-one-sided": [{"step": None, "start": s} for s in ("cold", "warm", "chord")],
    "fd-central": [{"step": None, "start": s} for s in ("cold", "warm", "chord")],
    "unrolled-ad": [unrolled_ad.defaults | {"inner": i} for i in ("cg", "richardson", "jacobi", "direct")],
}
ISOLATING = {
    "run",
    "scaling",
    "check",
    "vcurve",
    "kink",
    "horizon",
    "tolerance",
    "unrolling",
    "invert",
    "consistency",
    "identify",
}
BARS = {
    "bar[n=1]": {"n": 1},
    "bar[n=2]": {"n": 2},
    "bar": {},
    "bar[raw]": {"parametrization": "raw"},
    "bar[alpha]": {"alpha": 0.3},
    "bar[raw,alpha]": {"parametrization": "raw", "alpha": 0.3},
    "bar[sensors]": {"n": 12, "sensors": [2, 3, 7]},
    "bar[noise]": {"n": 21, "sensors": 21, "noise": 0.01, "seed": 4},
    # at `somewhere` 0.1 to 0.3 m away from a kink; the rounded ones in the middle of their curves, wide enough to see
    "bar[penalty]": {"n": 3, "sensors": 2, "stop": "penalty", "alpha": 0.1},
    "bar[penalty,open]": {"n": 3, "sensors": 2, "stop": "penalty", "gap": 1.5, "parametrization": "raw"},
    "bar[softplus]": {"n": 3, "sensors": 2, "stop": "softplus", "width": 0.1},
    "bar[quadratic]": {"n": 3, "sensors": 2, "stop": "quadratic", "width": 0.2, "k_c": 3.0},
    "bar[multiplier]": {"n": 3, "sensors": 2, "stop": "multiplier", "parametrization": "raw", "alpha": 0.1},
    "bar[multiplier,open]": {"n": 3, "sensors": 2, "stop": "multiplier", "gap": 1.5},
    "bar[multiplier,tip]": {"n": 4, "sensors": 4, "stop": "multiplier", "gap": -0.2},
}
ADVECTIONS = {
    "advection": {"n": 4},
    "advection[source]": {"n": 3, "unknown": "source", "angle": 200.0, "sensors": "everywhere"},
    "advection[raw,alpha]": {"n": 3, "parametrization": "raw", "kappa": 1.0, "alpha": 0.3},
}


def zoo() -> dict[str, Problem]:
    """Every registered kind of problem, in small variants."""
    bars = {name: Bar(**options) for name, options in BARS.items()}
    advections = {name: Advection(**options) for name, options in ADVECTIONS.items()}
    rod = with_synthetic_data(Rod(n=4, parts=2, unknown="film+flux", alpha=0.1, tip="convective", sensors=3))
    follower = Block(nx=1, ny=1, nz=2, parametrization="raw", derivatives="hand", load="follower", cases=2)
    return bars | advections | {"rod": rod, "duffing": Duffing(), "block[n=2]": Block(n=2), "block[follower]": follower}


def options_of(route: Route, problem: Problem) -> list[dict[str, Any]]:
    """Those of OPTIONS that run on the problem, but for CG inside Newton steps, which test_unrolled has."""
    able = [options for options in OPTIONS.get(route.name, [{}]) if route.objection(problem, **options) is None]
    return [options for options in able if problem.linear or options.get("inner") != "cg"]


def somewhere(problem: Problem, seed: int = 0) -> Array:
    """A random p near the start, inside its domain."""
    p = problem.parameters.start + 0.3 * np.random.default_rng(seed).uniform(-1, 1, len(problem.parameters))
    return problem.parameters.check(p, "test")


def relative_error(g: Array, reference: Array) -> float:
    return float(np.linalg.norm(g - reference) / np.linalg.norm(reference))


@pytest.fixture
def cli(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The command line, called in this process, in an empty folder; verbs that would start others do not."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> Ran:
        if arguments[0] in ISOLATING and not {"--isolate", "--help", "-h"} & {*arguments}:
            arguments = (*arguments, "--no-isolate")
        monkeypatch.setattr(sys, "argv", ["routes", *arguments])
        result = CliRunner().invoke(main, list(arguments))
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return Ran(result.exit_code, result.stdout, result.stderr)

    return call


@pytest.fixture(scope="session")
def forks() -> Iterator[Forks]:
    """Commands in processes of their own that need not import anything first."""
    forks = Forks()
    yield forks
    forks.end()


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Shell]:
    shell = Shell(tmp_path)
    yield shell
    for process in shell.alive():
        process.kill()
        process.wait()  # a zombie would fail the tests that look for children
