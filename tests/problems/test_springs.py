"""A face on springs of unknown stiffness: closed forms, gradients by every exact route, what is refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import relative_error
from test_plate import complex_gradient, displacements

from gradient_routes.bench.cases.case import problems, routes
from gradient_routes.bench.inversion.invert import Engine, invert
from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.mechanics.solid import Solid
from gradient_routes.problems.plate import Plate
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.sensitivity import Sensitivity
from gradient_routes.routes.synthetic_data import with_synthetic_data
from gradient_routes.routes.tangent import tangent

TIGHT = Solver(rtol=1e-14)
HAND: dict[str, Any] = {"n": 2, "derivatives": "hand", "support": "springs"}
E, K, TRACTION = 2e6, 3e7, 2e5  # [Pa], [Pa/m], [Pa]


def stretch() -> float:
    """s of a neo-Hookean bar with nu = 0, mu (s - 1/s) = t, mu = E/2."""
    a = 2.0 * TRACTION / E
    return float(0.5 * (a + np.sqrt(a * a + 4.0)))


def bar_data(folder: Path, axes: str) -> str:
    """u = t/k + (s - 1) x along the bar, 0 across."""
    x = np.random.default_rng(0).uniform(size=(9, len(axes)))
    u = np.zeros_like(x)
    u[:, -1] = TRACTION / K + (stretch() - 1.0) * x[:, -1]
    rows = [",".join(map(repr, row)) for row in np.c_[x, u].tolist()]
    (folder / "bar.csv").write_text("\n".join([",".join([*axes, *(f"u{axis}" for axis in axes)]), *rows]))
    return str(folder / "bar.csv")


@pytest.mark.parametrize("kind", [Plate, Block])
def test_a_bar_on_springs_moves_by_t_over_k_and_tells_E_and_k(kind: type[Solid], tmp_path: Path) -> None:
    data = bar_data(tmp_path, "xyz" if kind is Block else "xy")
    solid = kind(**HAND, nu=0.0, unknown="layers", layers=1, traction=TRACTION, data=data)
    p = np.log([E, K])
    assert solid.objective(Model(solid, TIGHT).solve(p).u, p) < 1e-26
    U = displacements(solid, p)
    assert U[solid.mesh.boundary("bottom").node_set, -1] == pytest.approx(TRACTION / K, rel=1e-10)
    assert solid.parameters.label(1) == "log k"
    assert solid.stated(p) == pytest.approx({"k [Pa/m]": K})
    softer = solid.scaled(p, 0.5)
    assert softer == pytest.approx(np.log([0.5 * E, 0.5 * K]))


def test_an_inversion_finds_both(tmp_path: Path, cli: Any) -> None:
    body = f"n=2,derivatives=hand,support=springs,nu=0,unknown=layers,layers=1,traction={TRACTION}"
    problem = f"plate[{body},data={bar_data(tmp_path, 'xy')}]"
    ran = cli("invert", "--problem", problem, "--optimizer", "gauss-newton", "--no-plot", "--no-store")
    assert ran.code == 0, ran.err
    assert "k [Pa/m] 3e+07 +- " in ran.out
    assert f"{np.log(E):.4g}" in next(line for line in ran.out.splitlines() if line.startswith("log E"))


VARIANTS: dict[str, dict[str, Any]] = {
    "layers, Tikhonov": {"unknown": "layers", "layers": 2, "alpha": 0.1},
    "raw moduli, two loads": {"parametrization": "raw", "cases": 2, "alpha": 0.1, "phi": "tv"},
    "constants": {"unknown": "constants", "law": "mooney-rivlin", "alpha": 1e-3},
    "E,nu": {"unknown": "constants", "constants": "E,nu"},
    "k_n and k_t": {"support": "springs-nt", "unknown": "layers", "alpha": 0.1},
    "raw k_n and k_t of a ring": {"support": "springs-nt", "kind": "axisymmetric", "parametrization": "raw"},
    "a ring": {"kind": "axisymmetric", "radius": 0.5, "element": "tri6", "data": "twin", "noise": 1e-3},
    "raw moduli, amplitude": {
        "parametrization": "raw",
        "alpha": 0.1,
        "phi": "amplitude",
        "motion": "rigid",
        "data": "twin",
    },
}


@pytest.mark.parametrize("name", VARIANTS)
def test_exact_routes_agree_with_complex_steps(name: str) -> None:
    plate = with_synthetic_data(Plate(**HAND | VARIANTS[name]))
    check(plate, (tangent, adjoint))


def test_routes_by_jax_agree_with_complex_steps() -> None:
    check(Plate(n=1, law="linear", support="springs-nt", unknown="load", load="displacement"), (adjoint, implicit_ad))


@pytest.mark.parametrize("kind", [Plate, Block])
def test_stiffnesses_along_the_normal_and_across_come_back_exactly(kind: type[Solid]) -> None:
    """Of a homogeneous body pulled obliquely: int k u dA over its face balances the load, component by component."""
    t = 0.05 * np.array([0.6, 0.8] if kind is Plate else [0.6, 0.0, 0.8])
    along = ",".join(f"{c:g}" for c in t / 0.05)
    options = {"unknown": "constants", "constants": "E,nu", "direction": along, "traction": 0.05, "data": "twin"}
    solid = with_synthetic_data(kind(**HAND | {"support": "springs-nt"} | options, sensors="everywhere"))
    truth, springs = solid.truth(), solid.solid.springs
    k_n, k_t = springs.k(truth)
    U = displacements(solid, truth)[springs.facets.nodes]
    u = np.einsum("fqa,fai,fq->i", springs.facets.N, U, springs.facets.areas(solid.mesh.geometry.X, np))
    assert k_n != k_t
    np.testing.assert_allclose(np.where(np.arange(len(t)) == len(t) - 1, k_n, k_t) * u, t, atol=1e-12)
    p = solid.parameters.start
    for route in (tangent, adjoint):
        g = route.prepare(Model(solid, TIGHT), p)(p).gradient
        assert relative_error(g, complex_gradient(solid, p)) < 1e-12, route.name
    spec, by = problems([f"{kind.name}[derivatives=hand]"])[0], routes(["adjoint"])[0]
    ended = invert(spec, by, Engine("gauss-newton"), made=solid)
    assert ended.p == pytest.approx(truth, abs=1e-6)  # |dJ/dp| is 1e-9 of 1/2 |d|^2
    assert [*solid.stated(truth)][-2:] == ["k_n [Pa/m]", "k_t [Pa/m]"]


def check(plate: Solid, by: tuple[Any, ...]) -> None:
    parameters = plate.parameters
    p = parameters.start + 0.05 * parameters.scale * np.random.default_rng(0).uniform(-1.0, 1.0, len(parameters))
    model, exact = Model(plate, TIGHT), complex_gradient(plate, p)
    for route in by:
        assert relative_error(route.prepare(model, p)(p).gradient, exact) < 1e-12, route.name
    if not plate.alpha:
        state = model.solve(p)
        seen = plate.observation(state.u, p)
        assert relative_error(Sensitivity(model, state).T @ (seen.predicted - seen.data), exact) < 1e-12


def test_hard_springs_are_a_clamp_and_products_are_those_of_the_matrix() -> None:
    held, springs = Plate(n=2, derivatives="hand"), Plate(**HAND)
    p = np.append(held.parameters.start, np.log(1e7))
    np.testing.assert_allclose(displacements(springs, p), displacements(held, p[:-1]), atol=1e-6)
    u, rng = Model(springs).solve(springs.parameters.start).u, np.random.default_rng(0)
    v, p = rng.standard_normal(len(u)), springs.parameters.start
    product = springs.tangent(u, p) @ v
    np.testing.assert_allclose(springs.tangent_operator(u, p) @ v, product, rtol=1e-10, atol=1e-12)
    q, _ = springs.regularization, springs.prior(p)
    assert q.pairs.max() == 3  # of four cells; k has no neighbours


def test_a_finer_mesh_has_the_same_springs() -> None:
    plate = Plate(**HAND)
    p = np.append(np.full(4, 0.3), 1.5)
    finer, q = plate.refined(p)
    assert (len(q), q[-1], finer.parameters.label(16)) == (17, 1.5, "log k")
    assert finer.fields(q, Model(finer).solve(q).u, None, q).cell_data["E"] == pytest.approx(np.exp(0.3))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"clamped": "none", "fixed": "x@left,y@bottom"}, "support needs clamped"),
        ({"boundary": "measured", "data": "d.csv"}, "support does not go with boundary=measured"),
        ({"kind": "axisymmetric", "clamped": "left"}, "clamped=left lies on the axis and has no area for springs"),
    ],
)
def test_what_cannot_be_is_one_line(options: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=re.escape(says)):
        Plate(**HAND | options)
