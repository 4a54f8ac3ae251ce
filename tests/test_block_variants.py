"""All routes on all that a block can be: unknowns, laws, loads, elements, hand-derived derivatives, data."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import relative_error

from problems.block import Block
from problems.problem import Array
from routes.adjoint import adjoint
from routes.complex_step import complex_step
from routes.finite_difference import fd_central, fd_one_sided
from routes.implicit_ad import implicit_ad
from routes.model import Model
from routes.newton import Solver
from routes.tangent import tangent
from routes.twin import with_synthetic_data
from routes.unrolled_ad import unrolled_ad

SMALL: dict[str, Any] = {"nx": 1, "ny": 2, "nz": 2}
VARIANTS: dict[str, dict[str, Any]] = {
    "layers": {"unknown": "layers", "layers": 2, "law": "linear"},
    "constants": {"unknown": "constants", "law": "yeoh"},
    "traction": {"unknown": "traction"},
    "shape": {"unknown": "shape"},
    "load": {"unknown": "load"},
    "mooney-rivlin": {"law": "mooney-rivlin", "cases": 2},
    "ogden": {"law": "ogden", "unknown": "constants"},
    "hand": {"derivatives": "hand", "parametrization": "raw"},
    "hand constants": {"derivatives": "hand", "law": "mooney-rivlin", "unknown": "constants", "load": "follower"},
    "hand layers": {"derivatives": "hand", "unknown": "layers", "layers": 2, "cases": 2, "data": "twin"},
    "follower": {"load": "follower", "cases": 2},
    "follower shape": {"load": "follower", "unknown": "shape", "element": "tet4"},
    "grip": {"load": "displacement", "cases": 2},
    "grip load": {"load": "displacement", "unknown": "load"},
    "tet4": {"element": "tet4"},
    "tet10 shape": {"element": "tet10", "ny": 1, "nz": 1, "unknown": "shape", "surface": "right"},
    "markers": {
        "markers": 6,
        "components": "in-plane",
        "face": "right",
        "data": "twin",
        "noise": 1e-3,
        "size": "1,2,1",
    },
    "twin traction": {"unknown": "traction", "data": "twin", "size": "2"},
}
UNROLLED = ("layers", "constants", "traction", "shape", "load")  # every unknown: third derivatives compile long
TIGHT = Solver(rtol=1e-14)


@pytest.mark.parametrize("name", VARIANTS)
def test_every_route_gives_the_gradient_of_every_kind_of_block(name: str) -> None:
    """Against the complex step, which knows neither R_p nor a transpose; itself held to finite differences."""
    problem = with_synthetic_data(Block(**SMALL | VARIANTS[name]))
    p = near_start(problem)
    exact = complex_step.prepare(Model(problem, TIGHT), p)(p).gradient
    J = Model(problem, TIGHT).solve(p).J
    tolerances = {
        tangent: 1e-11,
        adjoint: 1e-11,
        implicit_ad: 1e-11,
        unrolled_ad: 1e-8,
        fd_central: 1e-7,
        fd_one_sided: 1e-5,
    }
    for route, tolerance in tolerances.items():
        if (route is unrolled_ad and name not in UNROLLED) or (route is not adjoint and name == "ogden"):
            continue
        if route.objection(problem) is None:
            options = {"start": "chord"} if route in (fd_central, fd_one_sided) else {}
            result = route.prepare(Model(problem, TIGHT), p, **options)(p)
            assert relative_error(result.gradient, exact) < tolerance, route.name
            assert result.J is None or result.J == pytest.approx(J, rel=1e-9, abs=1e-15), route.name
        else:
            pytest.fail(f"{route.name} does not run: {route.objection(problem)}")


def near_start(problem: Block) -> Array:
    """Off the start, by a hundredth of what p_i naturally changes by."""
    parameters = problem.parameters
    return parameters.start + 0.01 * parameters.scale * np.random.default_rng(0).uniform(-1, 1, len(parameters))
