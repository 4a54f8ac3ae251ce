"""Adapters of this package: what their metadata say, and their gradients where their environments are."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import pytest
from conftest import relative_error, somewhere

from gradient_routes.bench.cases.registry import entries
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.vibrating_bar import VibratingBar
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.foreign.foreign import of_manifest
from gradient_routes.routes.foreign.manifest import Manifest, manifest, shipped
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.synthetic_data import with_synthetic_data

MANIFESTS = {name: manifest(script) for name, script in shipped().items()}
PROBLEMS = {
    "bar": lambda **options: Bar(n=8, **options),
    "hyperelastic": lambda **options: Block(n=2, **options),
    "vibrating-bar": lambda **options: with_synthetic_data(VibratingBar(**options)),  # N = 8, T = 60
}
# to rounding: Newton's last step may end just below a looser tolerance or many digits below it
TIGHT = {"bar": Solver(rtol=1e-13, adjoint_rtol=1e-13), "hyperelastic": Solver(rtol=1e-14, adjoint_rtol=1e-13)}
TIGHT["vibrating-bar"] = Solver()
# the others: 1e-12, the tolerance times a condition number; the gradient of an iterate lags behind it by k rho^k
ACCURACY = {"warp-unrolled": 1e-10, "taichi": 1e-10}
RANKS = 2  # of MPI: more than that on few processors wait for each other
DEFAULTS = 1e-4  # of frameworks that stop at an absolute |R| of 1e-6 by default


def cases() -> Iterator[Any]:
    """Every adapter on every problem that it knows, with every option; with log E, and at its defaults with E too."""
    for name, found in MANIFESTS.items():
        for kind, (number, choices) in product(found.cases, enumerate(product(*found.options.values()))):
            for parametrization in ("raw", "log")[number > 0 :]:
                options = dict(zip(found.options, choices, strict=True))
                if int(options.get("ranks", 1)) > RANKS:
                    continue
                label = "-".join((name, kind, parametrization, *choices))
                yield pytest.param(found, kind, parametrization, options, id=label)


def skip_without_environment(found: Manifest) -> None:
    if not found.ready:
        pytest.skip(f"{found.name} has no environment here: routes environments create {found.name}")


@pytest.mark.parametrize(("found", "kind", "parametrization", "options"), list(cases()))
def test_the_gradient_is_ours(found: Manifest, kind: str, parametrization: str, options: dict[str, str]) -> None:
    skip_without_environment(found)
    known = {name: values[0] for name, values in found.cases[kind].items() if name == "scheme"}
    problem, solver = PROBLEMS[kind](parametrization=parametrization, **known), TIGHT[kind]
    p = somewhere(problem)
    reference = complex_step if kind == "vibrating-bar" else adjoint
    J, expected, *_ = reference.prepare(Model(problem, solver), p)(p)
    result = of_manifest(found).prepare(Model(problem, solver), p, **options)(p)
    tolerance = DEFAULTS if options.get("tolerances") == "default" else ACCURACY.get(found.name, 1e-12)
    assert result.J == pytest.approx(J, rel=tolerance)
    assert relative_error(result.gradient, expected) <= tolerance


@pytest.mark.parametrize("name", MANIFESTS)
def test_an_adapter_is_a_route(name: str) -> None:
    assert entries("route")[name].failure is None


@pytest.mark.parametrize("name", [name for name in MANIFESTS if not MANIFESTS[name].compiled])
def test_an_adapter_is_short(name: str) -> None:
    code = MANIFESTS[name].script.read_text().split('"""', 2)[2].splitlines()
    assert len([line for line in code if line.strip() and not line.lstrip().startswith("#")]) <= 45


@pytest.mark.parametrize("name", ["torch-fem", "warp"])
def test_a_solve_that_fails_says_so(name: str) -> None:
    skip_without_environment(MANIFESTS[name])
    problem = Block(n=2)
    soft = problem.parameters.start - 12.0  # under a load far beyond what Newton's method can take
    with pytest.raises(NotConverged, match=name):
        of_manifest(MANIFESTS[name]).prepare(Model(problem, Solver()), soft)(soft)
