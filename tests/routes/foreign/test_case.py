"""What a problem says of itself to other codes is enough to compute its J without any of our code."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gradient_routes.bench.studies.options import one_problem
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.errors import NotOffered
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.problems.subspace import Subspace
from gradient_routes.routes.foreign.foreign import undescribed
from gradient_routes.routes.model import Model
from gradient_routes.routes.synthetic_data import with_synthetic_data

# corners of VTK's hexahedron and ends of the edges of its quadratic tetrahedron, whose middles are nodes 4 to 9
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
EDGES = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
GAUSS = 0.5 + np.array([-1.0, 1.0]) / np.sqrt(12.0)


def modulus(case: dict[str, Any], p: Array) -> Array:
    return np.exp(p) if case["parametrization"] == "log" else p


def bar(case: dict[str, Any], p: Array) -> float:
    k = modulus(case, p) * case["area"] * case["n"] / case["length"]
    u = np.cumsum(case["load"] / k)
    return float(0.5 * ((u[case["sensors"] - 1] - case["data"]) ** 2).sum())


def linear_block(case: dict[str, Any], p: Array) -> float:
    """Linear elasticity on trilinear hexahedra, as any textbook has it."""
    E, nu, X = modulus(case, p)[case["modulus"]], case["nu"], case["points"]
    mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    K, I = np.zeros((X.size, X.size)), np.eye(3)
    for e, nodes in enumerate(case["cells"]):
        for xi in np.stack(np.meshgrid(*[GAUSS] * 3), axis=-1).reshape(-1, 3):
            N = np.where(CORNERS == 1, xi, 1 - xi)  # (8, 3), its product over an axis is a shape function
            dN = (2 * CORNERS - 1) * np.stack([N[:, 1] * N[:, 2], N[:, 0] * N[:, 2], N[:, 0] * N[:, 1]], axis=1)
            dX = X[nodes].T @ dN
            dN, volume = dN @ np.linalg.inv(dX), np.linalg.det(dX) / 8
            assert volume > 0
            D = mu[e] * (np.einsum("ik,jl->ijkl", I, I) + np.einsum("il,jk->ijkl", I, I))
            D += lam[e] * np.einsum("ij,kl->ijkl", I, I)
            K_e = np.einsum("aj,ijkl,bl->aibk", dN, D, dN).reshape(24, 24) * volume
            at = (3 * nodes[:, None] + np.arange(3)).ravel()
            K[np.ix_(at, at)] += K_e
    free = np.setdiff1d(np.arange(X.size), (3 * case["clamped"][:, None] + np.arange(3)).ravel())
    u = np.zeros(X.size)
    u[free] = np.linalg.solve(K[np.ix_(free, free)], case["forces"].ravel()[free])
    return float(0.5 * ((u.reshape(-1, 3)[case["sensors"]] - case["data"]) ** 2).sum())


BLOCKS = ["size=1,2,1.5", "parametrization=raw,clamped=left,loaded=right,sensors=top", "data=twin,noise=1e-3"]
BLOCKS += ["unknown=layers,layers=2,nu=0.1"]


def vibrating_bar(case: dict[str, Any], p: Array) -> float:
    """Stepped by dense matrices: A z_t + B z_{t-1} = h f, z = (u, v)."""
    n, h, L_e = case["n"], case["dt"], case["length"] / case["n"]
    stretch, m = np.eye(n) - np.eye(n, k=-1), np.full(n, case["density"] * case["area"] * L_e)
    m[-1] /= 2
    K = stretch.T @ np.diag(modulus(case, p) * case["area"] / L_e) @ stretch
    I, M, (a, b) = np.eye(n), np.diag(m), WEIGHTS[case["scheme"]]
    A, B = np.block([[I, -a * h * I], [b * h * K, M]]), np.block([[I, (1 - a) * h * I], [(b - 1) * h * K, M]])
    z, J, F = np.zeros(2 * n), 0.0, case["force"]
    for t in range(1, case["steps"] + 1):
        f = np.zeros(2 * n)
        f[-1] = h * (b * F[t] + (1 - b) * F[t - 1])
        z = np.linalg.solve(A, B @ z + f)
        J += 0.5 * ((z[case["sensors"] - 1] - case["data"][t - 1]) ** 2).sum()
    return float(J)


WEIGHTS = {
    "newmark": (0.5, 0.5),
    "backward-euler": (1.0, 1.0),
    "central-difference": (1.0, 0.0),
}  # of the new v and force
CASES = {f"bar[n=7,sensors=2..5,parametrization={of}]": bar for of in ("log", "raw")}
CASES |= {f"block[nx=2,ny=1,nz=3,law=linear,{options}]": linear_block for options in BLOCKS}

BARS = [f"scheme={scheme},parametrization={of}" for scheme, of in zip(WEIGHTS, ("log", "raw", "log"), strict=True)]
CASES |= {f"vibrating-bar[n=4,steps=9,dt=0.1,length=2,area=3,density=0.7,{options}]": vibrating_bar for options in BARS}


def made(selector: str) -> Problem:
    return with_synthetic_data(one_problem(selector)())


@pytest.mark.parametrize("selector", CASES)
def test_the_case_is_enough_to_compute_J(selector: str) -> None:
    problem = made(selector)
    p = problem.parameters.start + 0.2 * np.sin(1.0 + np.arange(len(problem.parameters)))
    assert undescribed(problem) is None
    assert CASES[selector](problem.case(), p) == pytest.approx(Model(problem).value(p), rel=1e-11)


@pytest.mark.parametrize("element", ["tet4", "tet10"])
def test_tetrahedra_are_in_the_order_of_vtk(element: str) -> None:
    case = made(f"block[n=1,element={element}]").case()
    X = case["points"][case["cells"]]
    assert case["cell_type"] == {"tet4": "tetra", "tet10": "tetra10"}[element]
    assert (np.linalg.det(X[:, 1:4] - X[:, :1]) > 0).all()
    if element == "tet10":
        np.testing.assert_allclose(X[:, 4:], X[:, EDGES].mean(axis=2), atol=1e-15)


def test_the_law_and_its_constants_are_told() -> None:
    case = made("block[n=1,law=yeoh,nu=0.25]").case()
    assert (case["kind"], case["law"], case["nu"]) == ("hyperelastic", "yeoh", 0.25)


@pytest.mark.parametrize(
    ("selector", "what"),
    [
        ("bar[stop=penalty]", "a stop"),
        ("bar[alpha=0.1]", "alpha=0.1"),
        ("vibrating-bar[stop=penalty]", "a stop"),
        ("vibrating-bar[alpha=0.1]", "alpha=0.1"),
        ("vibrating-bar[damping=skew]", "damping"),
        ("vibrating-bar[unknown=moduli,velocity]", "unknown=moduli,velocity"),
        ("block[n=1,load=follower]", "load=follower"),
        ("block[n=1,cases=2]", "cases=2"),
        ("block[n=1,unknown=constants]", "unknown=constants"),
        ("block[n=1,markers=3]", "markers=3"),
        ("block[n=1,alpha=0.5]", "alpha=0.5"),
        ("block[n=1,data=twin,motion=translation]", "motion=translation"),
    ],
)
def test_an_option_that_other_codes_cannot_be_told_is_named(selector: str, what: str) -> None:
    problem = made(selector)
    assert undescribed(problem) == f"{problem.name}: {what} is not described to other codes - leave it out"
    with pytest.raises(NotOffered, match=what):
        problem.case()


def test_a_part_of_a_problem_is_not_described() -> None:
    part = Subspace(Bar(), np.eye(8)[:, :2], np.zeros(8), start=np.zeros(2), scale=np.ones(2))
    assert undescribed(part) == "bar: a part of its parameters is not described to other codes"


def test_a_problem_that_is_not_described_is_skipped(cli) -> None:
    (row,) = cli(*"run --problem advection[n=2] --route adapter[command=./it] --no-store --json".split()).rows
    assert (row["status"], row["reason"]) == (
        "skipped",
        "adapter needs a description for other codes, which advection does not offer",
    )
