"""Do the start and the units matter? The same data from starts a million times apart, and in seven systems of units.

    python -m benchmarks.starts

Noisy data of every problem that reads a file. Exit code 1 where an answer differs by more than 1e-6, or Gauss-Newton
takes over two steps more or less; the steps of L-BFGS depend on where it starts within the decade that it is left.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gradient_routes.bench.cases import case
from gradient_routes.bench.inversion.invert import Engine, invert
from gradient_routes.bench.inversion.optimizers import Name
from gradient_routes.routes.model import Model

# length and stress in units of m and Pa: Pa, kPa, MPa, GPa with m; MPa and GPa with mm; MPa with um
UNITS = ((1.0, 1.0), (1.0, 1e3), (1.0, 1e6), (1.0, 1e9), (1e-3, 1e6), (1e-3, 1e9), (1e-6, 1e6))
STARTS = (1e-6, 1e-3, 1.0, 1e3, 1e6)
OPTIMIZERS: tuple[Name, ...] = ("gauss-newton", "lbfgs")
SAME, STEPS = 1e-6, 2
E, NU, NOISE = 2e11, 0.3, 1e-3
Given = Mapping[str, Any]


def solid(name: str, folder: Path) -> Callable[[float, float, float | None], str]:
    """A plate or block of E = 200 GPa under 100 MPa, with data at all nodes, in units of length and stress."""
    n, axes = (4, "xy") if name == "plate" else (2, "xyz")
    options = f"n={n},law=linear,unknown=constants"
    (spec,) = case.problems([f"{name}[{options},traction=1e8,modulus={E}]"])
    made = spec()
    p, X = made.parameters.start, made.mesh.geometry.X
    u = Model(made).solve(p).u
    U = made.solid.displacements(u, made.solid.setup(p), 0, np.arange(len(X)))
    U = U + NOISE * np.abs(U).max() * np.random.default_rng(0).standard_normal(U.shape)
    free = np.flatnonzero(X[:, -1] > 0.0)

    def selector(length: float, pascal: float, start: float | None) -> str:
        path = folder / f"{name}_{length:g}.csv"
        header = ",".join([*axes, *(f"u{axis}" for axis in axes)])
        np.savetxt(path, np.hstack([X, U])[free] / length, "%.17g", ",", header=header, comments="")
        given = f"{options},size={1.0 / length},traction={1e8 / pascal},data={path}"
        return f"{name}[{given}{'' if start is None else f',modulus={start * E / pascal}'}]"

    return selector


def bar(folder: Path) -> Callable[[float, float, float | None], str]:
    """Four moduli about 200 GPa of a bar of 250 mm and 100 mm^2 under 5 kN."""
    strains = 5e3 / (1e-4 * E * np.array([1.0, 1.2, 0.8, 1.1]))
    d = np.cumsum(strains * 0.25 / 4) * (1.0 + NOISE * np.array([1.0, -1.0, 0.5, -0.5]))

    def selector(length: float, pascal: float, start: float | None) -> str:
        path = folder / f"bar_{length:g}.csv"
        path.write_text("node,displacement\n" + "".join(f"{i + 1},{v / length:.17g}\n" for i, v in enumerate(d)))
        sizes = f"length={0.25 / length},area={1e-4 / length**2},force={5e3 / (pascal * length**2)}"
        given = f"n=4,{sizes},data={path}{'' if start is None else f',modulus={start * E / pascal}'}"
        return f"bar[{given}]"

    return selector


def coupon(folder: Path) -> Callable[[float, float, float | None], str]:
    """Yeoh's constants of two curves about 1 MPa."""
    lam = np.linspace(1.1, 3.0, 10)
    i1 = lam**2 + 2.0 / lam - 3.0
    P = 2.0 * (lam - lam**-2.0) * (0.19e6 - 4e3 * i1 + 150.0 * i1**2)
    P = P * (1.0 + NOISE * np.random.default_rng(0).standard_normal(len(lam)))

    def selector(length: float, pascal: float, start: float | None) -> str:
        path = folder / f"coupon_{pascal:g}.csv"
        np.savetxt(path, np.stack([lam, P / pascal], 1), "%.17g", ",", header="stretch,stress", comments="")
        given = f"law=yeoh,mode=uniaxial,data={path}"
        return f"coupon[{given}{'' if start is None else f',modulus={start * 1e6 / pascal}'}]"

    return selector


def rod(folder: Path) -> Callable[[float, float, float | None], str]:
    """A film coefficient, about 18 W/m2/K; its units are those of the file's header."""
    x = np.linspace(0.02, 0.35, 8)
    m = np.sqrt(4.0 * 18.0 / (110.0 * 0.012))
    T = 21.5 + 63.5 * np.cosh(m * (0.4 - x)) / np.cosh(m * 0.4) + 0.1 * np.array([1, -1, 0, 1, -1, 0, 1, -1])

    def selector(length: float, pascal: float, start: float | None) -> str:
        path, unit = folder / f"rod_{length:g}.csv", {1.0: "m", 1e-3: "mm", 1e-6: "um"}[length]
        np.savetxt(path, np.stack([x / length, T], 1), "%.17g", ",", header=f"x [{unit}],T [degC]", comments="")
        given = f"data={path},length=400mm,diameter=12mm,conductivity=110,base=85degC,ambient=21.5degC"
        return f"rod[{given}{'' if start is None else f',film={18.0 * start}'}]"

    return selector


def found(selector: str, optimizer: Name) -> tuple[np.ndarray, int]:
    """p, of moduli themselves rather than logarithms, and the number of steps."""
    (spec,), (route,) = case.problems([selector]), case.routes(["adjoint"])
    ended = invert(spec, route, Engine(optimizer))
    log = ended.made.parameters.label(0).startswith("log")
    return np.exp(ended.p) if log else ended.p, len(ended.iterates) - 1


def compared(
    selector: Callable[[float, float, float | None], str], optimizer: Name, of: str
) -> Iterator[tuple[float, int]]:
    """For every start or system of units: how far the answer is from that in SI without a start, and its steps."""
    p_0, steps_0 = found(selector(1.0, 1.0, None), optimizer)
    cases = [(1.0, 1.0, start) for start in STARTS] if of == "starts" else [(*units, None) for units in UNITS]
    for length, pascal, start in cases:
        p, steps = found(selector(length, pascal, start), optimizer)
        size = 1.0 if selector.__qualname__.startswith("rod") else pascal
        yield float(np.abs(p * size / p_0 - 1.0).max()), steps - steps_0


def main() -> None:
    well = True
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        selectors = {
            "plate": solid("plate", folder),
            "block": solid("block", folder),
            "bar": bar(folder),
            "rod": rod(folder),
            "coupon": coupon(folder),
        }
        for problem, selector in selectors.items():
            for optimizer in OPTIMIZERS:
                for of in ("starts", "units"):
                    off, steps = zip(*compared(selector, optimizer, of), strict=True)
                    good = max(off) <= SAME and (optimizer == "lbfgs" or max(map(abs, steps)) <= STEPS)
                    well = well and good
                    counts = " ".join(f"{step:+d}" for step in steps)
                    verdict = "" if good else "  NO"
                    print(f"{problem:6} {optimizer:12} {of:6}: off by {max(off):.1e}, steps {counts}{verdict}")
    sys.exit(0 if well else 1)


if __name__ == "__main__":
    main()
