"""A store whose numbers are made up, every table filled: what reports are timed and tested on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.environment import environment
from gradient_routes.bench.cases.registry import study_tables
from gradient_routes.bench.cases.row import empty_row
from gradient_routes.bench.store.store import Store
from gradient_routes.routes.tally import KINDS

ROUTES = (
    "fd-one-sided",
    "fd-central",
    "complex-step",
    "tangent",
    "adjoint",
    "unrolled-ad",
    "implicit-ad",
    "somebodys-route",
)
WHEN = "2026-01-01T00:00:00.000+00:00"
Tables = dict[str, list[Row]]


def fill(store: Store, cases: int, studies: int = 1, seed: int = 0) -> None:
    """So many cases of eight routes, and so many studies of every kind."""
    rng = np.random.default_rng(seed)
    rows = [case(k, rng) for k in range(cases)]
    store.append_all([(row, None, environment()) for row in rows])
    for k in range(studies):
        problem = f"bar[n={8 * (k + 1)}]"
        for make in MAKERS:
            made = {name: of for name, of in make(problem, 8 * (k + 1), rng).items() if name in study_tables()}
            if made:
                whole = {name: [whole_row(name, row) for row in of] for name, of in made.items()}
                store.append_study(next(iter(whole)), whole, WHEN)
    store.append_study("tolerance", {}, WHEN, "timeout", "after 3600 s of --timeout", "its last words")


def whole_row(table: str, row: Row) -> Row:
    """With every column, absent where nothing is said."""
    return dict.fromkeys(column.name for column in study_tables()[table].columns) | row


def case(k: int, rng: np.random.Generator) -> Row:
    """One of a grid of sizes, sensors and routes; every ninth is none."""
    route = ROUTES[k % len(ROUTES)]
    j = k // len(ROUTES)
    n, sensors = 2 ** (3 + j % 9), 4 + j // 9
    options = {"n": n, "sensors": sensors}
    row = empty_row() | {
        "problem": "bar",
        "problem_options": options,
        "route": route,
        "route_options": {"inner": "cg", "iterations": n} if route == "unrolled-ad" else {},
        "at": "start",
        "n_state": n,
        "n_param": n,
        "started": WHEN,
        "settings": {},
        "case_key": f"{k:064x}",
        "host": "nowhere",
    }
    if k % 9 == 8:
        return row | failed(k)
    return row | measured(route, n, rng)


def failed(k: int) -> Row:
    status = ("skipped", "pruned", "timeout", "failed", "crashed")[k // 9 % 5]
    words = {"stderr": "last line before it ended\n" * 3, "traceback": "Traceback (most recent call last):\n  ..."}
    return {"status": status, "reason": f"made up, {status}: number {k}"} | (
        words if status in ("failed", "crashed") else {}
    )


def measured(route: str, n: int, rng: np.random.Generator) -> Row:
    forward = 1e-5 * n**1.1
    solves = {"fd-one-sided": n + 1, "fd-central": 2 * n, "complex-step": n, "tangent": 1 + n / 20, "adjoint": 1.3}
    ratio = float(solves.get(route, 4.0) * rng.lognormal(0.0, 0.2))
    error = {"fd-one-sided": 1e-8, "fd-central": 1e-11, "unrolled-ad": 1e-9}.get(route, 1e-15)
    tape = 16 * n * n if route == "unrolled-ad" else None
    counts = dict.fromkeys(KINDS, 0) | {"forward_solves": max(1, int(solves.get(route, 1))), "factorizations": 1}
    counts |= {"transposed_solves": 1} if route in ("adjoint", "implicit-ad") else {}
    counts |= {"solves": n} if route == "tangent" else {"matvecs": 2 * n} if tape else {}
    return {
        "status": "ok",
        "objective": float(rng.lognormal()),
        "gradient": rng.standard_normal(min(n, 64)).tolist(),
        "gradient_norm": float(rng.lognormal()),
        "gradient_error": 0.0 if n == 8 and route == "tangent" else float(error * rng.lognormal()),
        "reference": "complex-step",
        "residual": 1e-14,
        "seconds": forward * ratio,
        "seconds_q1": forward * ratio * 0.95,
        "seconds_q3": forward * ratio * 1.05,
        "unstable": 0,
        "prepare_s": 0.01,
        "first_s": 0.02,
        "forward_s": forward,
        "forward_ratio": ratio,
        "peak_bytes": int(8 * n * (3 + ratio)),
        "tape_bytes": tape,
        "work": counts,
        "predicted_work": counts,
        "predicted_s": forward * ratio * float(rng.lognormal(0.0, 0.3)),
    }


def on(problem: str, n: int) -> Row:
    """The columns that say which problem a study is about."""
    return {"problem": "bar", "problem_options": {"n": n}, "at": "start", "n_state": n, "n_param": n}


def run(problem: str, n: int, route: str, optimizer: str) -> Row:
    by = {"route": route, "route_options": {}, "optimizer": optimizer, "alpha": 1e-3}
    return on(problem, n) | by | {"label": f"{problem} by {route}"}


def checks(problem: str, n: int, rng: np.random.Generator) -> Tables:
    what = {"problem": problem, "route": "adjoint" if n % 16 else "faulty-adjoint", "at": "start"}
    wrong = what["route"] != "adjoint"
    says = "a plateau of 0.3 that no step removes" if wrong else "differences agree to 2e-10"
    check = what | {"verdict": "wrong-gradient" if wrong else "agrees", "says": says, "next": "use it", "floor": 1e-10}
    h = 10.0 ** np.arange(-15.0, 0.5, 0.25)
    points = []
    for line in ("random direction 1", "random direction 2", "log E_1", "log E_2"):
        for tightened in (1.0, 1e-6) if wrong else (1.0,):
            noise = rng.lognormal(0.0, 0.6, h.size) * 1e-16 / h
            for step, one, two in zip(h, h + noise + 0.3 * wrong, h**2 + noise + 0.3 * wrong, strict=True):
                errors = {"step": step, "error_one_sided": one, "error_central": two, "slope": 1.0, "scale": 1.0}
                points.append(what | {"line": line, "line_says": "agrees", "tightened": tightened} | errors)
    return {"checks": [check], "points": points}


def tolerance(problem: str, n: int, rng: np.random.Generator) -> Tables:
    rows = []
    for route in ROUTES[:-1]:
        for rtol in 10.0 ** np.arange(-1.0, -14.0, -1.0):
            power = {"fd-one-sided": 1e7, "fd-central": 1e5}.get(route, 3.0)
            row = on(problem, n) | {"linear_solver": "krylov", "sweep": "both", "route": route, "route_options": {}}
            error = float(min(1.0, power * rtol) * rng.lognormal()) + 1e-15
            errors = {"gradient_error": error, "objective_error": rtol, "residual": rtol / 2, "adjoint_residual": rtol}
            rows.append(row | errors | {"rtol": rtol, "adjoint_rtol": rtol, "status": "ok"})
    return {"tolerance": rows}


def unrolling(problem: str, n: int, rng: np.random.Generator) -> Tables:
    rows: list[Row] = []
    fits: list[Row] = []
    for inner, rate in (("cg", 0.3), ("jacobi", 0.7), ("richardson", 0.8)):
        fits.append(
            on(problem, n) | {"inner": inner, "implicit_error": 1e-15, "meets": 64, "bytes_per_iteration": 512.0}
        )
        for k in (1, 2, 4, 8, 16, 32, 64, 128):
            errors = {"gradient_error": k * rate**k + 1e-15, "objective_error": rate ** (2 * k) + 1e-16, "status": "ok"}
            costs = {"tape_bytes": 512 * k, "products": 2 * k, "seconds": 1e-4 * k}
            rows.append(on(problem, n) | {"inner": inner, "iterations": k} | errors | costs)
    return {"unrolling": rows, "unrolling_fits": fits}


def kink(problem: str, n: int, rng: np.random.Generator) -> Tables:
    what = {"problem": f"bar[n={n},stop=multiplier]", "at": "start", "status": "ok"}
    rows = [what | {"kind": "event", "s": 1.25, "active_set": "closed", "active_set_right": "open", "slope": 0.0}]
    rows[0] |= {"slope_right": -0.4, "jump": -0.4}
    for route in ("adjoint", "fd-central"):
        for s in np.linspace(0.5, 2.0, 31):
            closed = s < 1.25
            J = {"objective": 1.0 if closed else 1.0 - 0.4 * (s - 1.25), "slope": 0.0 if closed else -0.4}
            rows.append(
                what | {"kind": "point", "route": route, "s": s, "active_set": "closed" if closed else "open"} | J
            )
    for step in 10.0 ** np.arange(-2.0, -8.0, -1.0):
        rows.append(what | {"kind": "stencil", "s": 1.25, "step": step, "off_left": 0.2, "off_right": 0.2 + step})
    for k_c in 10.0 ** np.arange(0.0, 6.0):
        off = {"off_objective": 1 / k_c, "off_slope": 2 / k_c, "curvature": k_c, "newton_iterations": 5, "width": 0.01}
        rows.append(what | {"kind": "trade", "route": "adjoint", "s": 1.0, "k_c": k_c} | off)
    return {"kink": rows}


def horizon(problem: str, n: int, rng: np.random.Generator) -> Tables:
    what = on(problem, n) | {"spread": 1e-3, "places": 12}
    rows = []
    for T in 2 ** np.arange(10):
        scatter = 1e-4 * float(np.exp(T / 40.0))
        slopes = {"slope": 1.0, "slope_mean": 1.0 + scatter * rng.standard_normal(), "slope_scatter": scatter}
        found = {"objective": 1.0, "gradient_norm": 1.0 + scatter, "quotient": 1.0, "flips": int(T // 100)}
        rows.append(
            what | {"steps": int(T), "status": "ok", "verdict": "noisy" if scatter > 0.3 else "smooth"} | slopes | found
        )
    return {"horizon": rows}


def inversion(problem: str, n: int, rng: np.random.Generator) -> Tables:
    histories, found, constants, fits, missed = [], [], [], [], []
    for route, optimizer, rate in (
        ("adjoint", "lbfgs", 0.5),
        ("adjoint", "descent", 0.9),
        ("adjoint", "gauss-newton", 0.05),
        ("fd-central", "lbfgs", 0.5),
    ):
        what = run(problem, n, route, optimizer)
        each = 2 * n if route == "fd-central" else 2
        for k in range(25):
            state = {"misfit": rate**k + 1e-4, "objective": rate**k + 2e-4, "gradient_norm": 3 * rate**k + 1e-8}
            cost = {"forward_solves": each * (k + 1), "adjoint_solves": k, "seconds": 1e-3 * each * (k + 1)}
            end = {"says": "gradient small" if k == 24 else None, "distance": rate ** (k / 2)}
            histories.append(what | {"iteration": k} | state | cost | end)
        truth = 1.0 + 0.3 * np.sin(6.0 * np.arange(n) / n)
        for i in range(n):
            seen = i < 0.7 * n
            values = {
                "start": 1.0,
                "truth": truth[i],
                "estimate": truth[i] * (1 + 0.02 * rng.standard_normal()) if seen else 1.0,
            }
            found.append(what | {"parameter": f"E_{i + 1}", "x": (i + 0.5) / n, "blind": int(not seen)} | values)
        for i in range(n):
            off = {"residual": 1e-3 * rng.standard_normal(), "standardized": rng.standard_normal(), "outlier": 0}
            missed.append(what | {"datum": f"u_{i + 1}", "x": (i + 0.5) / n, "measured": 1.0} | off)
        noise = {"noise": 1e-3, "noise_source": "stated", "chi2": 1.0, "moran": 0.1, "moran_z": 0.9}
        sure = {"sd": 0.01, "third_1": 0.9, "third_2": 1.0, "third_3": 1.1, "correlations": {"E": 1.0}}
        constants.append(what | {"constant": "E", "value": 1.0} | sure)
        fits.append(what | noise | {"data": n, "outliers": 0, "freedom": n - 2.0, "rms": 1e-3, "verdict": "explained"})
    found += block(n)
    told = {"constants": constants, "fit": fits, "residuals": missed}
    return {"inversion": histories, "estimates": found} | told


def block(n: int) -> list[Row]:
    what = run("block", n, "adjoint", "lbfgs") | {"problem": "block"}
    rows = []
    for x, y, z in np.ndindex(4, 4, 4):
        stiff = 3.0 if 1 <= x <= 2 and 1 <= y <= 2 else 1.0
        place = {"x": (x + 0.5) / 4, "y": (y + 0.5) / 4, "z": (z + 0.5) / 4, "blind": int(z == 0)}
        values = {"start": 1.0, "truth": stiff, "estimate": stiff - 0.2 * z * (stiff > 1.0)}
        rows.append(what | place | values | {"parameter": f"E_{x}{y}{z}"})
    return rows


def regularization(problem: str, n: int, rng: np.random.Generator) -> Tables:
    curve, trade = [], []
    what = run(problem, n, "adjoint", "lbfgs")
    for alpha in 10.0 ** np.arange(-8.0, 1.0, 0.5):
        chosen = (
            "corner" if abs(np.log10(alpha) + 4.5) < 0.1 else "discrepancy" if abs(np.log10(alpha) + 3) < 0.1 else None
        )
        sizes = {"misfit": 1e-4 + alpha, "phi": 1 / (1e-5 + alpha), "curvature": 1.0, "discrepancy": 1 + 1e2 * alpha}
        curve.append(what | sizes | {"alpha": alpha, "distance": 0.3, "chosen": chosen, "iterations": 20})
        parts = {"bias": 10 * alpha, "variance": 1e-4 / (1e-3 + alpha), "total": 10 * alpha + 1e-4 / (1e-3 + alpha)}
        trade.append(what | parts | {"alpha": alpha, "draws": 20})
    return {"lcurve": curve, "tradeoff": trade}


def identifiability(problem: str, n: int, rng: np.random.Generator) -> Tables:
    spectra, seen, sums = [], [], []
    for j, name in enumerate((problem, f"{problem}, two loads")):
        what = on(problem, n) | {"experiment": name}
        for k in range(n):
            value = 10.0 ** (3.0 - (9.0 - 2 * j) * k / n)
            above = {"singular_value": value * 1e-3, "relative_to_noise": value, "identifiable": int(value > 1.0)}
            spectra.append(what | {"index_": k + 1} | above)
            kind = "blind" if k > 0.8 * n else "weak" if k > 0.5 * n else "seen"
            share = {"seen": 0.02, "weak": 0.5, "blind": 1.0}[kind]
            place = {"parameter": f"E_{k + 1}", "x": (k + 0.5) / n}
            seen.append(what | place | {"kind": kind, "null_share": share, "column_norm": 1.0 - share})
        sums.append(what | {"data": n, "sigma": 1e-3, "rank": n // 2 + j, "blind": n // 5, "weak": n // 4, "gained": j})
    sensors = [
        on(problem, n)
        | {
            "experiment": problem,
            "criterion": criterion,
            "step": k,
            "sensor": f"node {3 * k}",
            "value": 3.0 * k,
            "rank": k,
        }
        for criterion in "DA"
        for k in range(1, 6)
    ]
    tables: Tables = {"spectrum": spectra, "identified": seen, "experiments": sums, "placement": sensors}
    return tables


def scaling(problem: str, n: int, rng: np.random.Generator) -> Tables:
    what = {"problem": "bar", "problem_options": {}, "at": "start"}
    fits: list[Row] = [
        what
        | {"route": route, "route_options": {}, "quantity": quantity, "against": "n_state", "law": "power", "points": 5}
        | {"exponent": 1.0 + k / 10, "exponent_low": 0.9 + k / 10, "exponent_high": 1.1 + k / 10, "prefactor": 1e-6}
        for k, route in enumerate(ROUTES[:-1])
        for quantity in ("seconds", "peak_bytes")
    ]
    races = [
        on(problem, n)
        | {
            "route": "adjoint",
            "route_options": {},
            "other": other,
            "other_options": {},
            "fixed_s": 2e-3,
            "each_s": 1e-9,
        }
        | {"break_even": at, "break_even_low": at / 1.5, "break_even_high": at * 1.5, "predicted": at, "points": 5}
        | {"says": f"adjoint is cheaper than {other} from n_p = {at:g} on"}
        for other, at in (("tangent", 2.0), ("fd-one-sided", 1.4))
    ]
    T = 64 * n
    marches: list[Row] = [
        on(problem, n)
        | {"route": "adjoint", "route_options": {"checkpoint": f"every={k}"}, "steps": T, "interval": k}
        | {"states_kept": T // k + k, "state_bytes": 16 * n * (T // k + k), "recomputed": (k - 1) * ((T - 1) // k)}
        | {"peak_bytes": 2e6 + 16 * n * (T // k + k), "seconds": 1.0, "least": "measured" if k == 8 * n**0.5 else None}
        for k in (4, 16, 64)
    ]
    return {"scaling_fits": fits, "break_even": races, "checkpoints": marches}


def consistency(problem: str, n: int, rng: np.random.Generator) -> Tables:
    runs: list[Row] = []
    steps: list[Row] = []
    what = {"problem": f"advection[n={n}]", "at": "start", "optimizer": "lbfgs"}
    for route, floor in (("adjoint", 1e-16), ("faulty-adjoint[fault=otd]", 1e-8), ("faulty-adjoint[fault=mesh]", 1e-6)):
        above = [10.0**-k + floor for k in range(12)]
        end = {"iterations": 11, "evaluations": 40, "objective": 1e-4 + above[-1], "above_minimum": above[-1]}
        outcome = {"status": "ok", "outcome": "converged" if route == "adjoint" else "stalled", "gradient_norm": floor}
        runs.append(what | {"route": route} | end | outcome)
        for k, height in enumerate(above):
            state = {"objective": 1e-4 + height, "above_minimum": height, "own_gradient_norm": height**0.5}
            steps.append(what | {"route": route, "iteration": k, "forward_solves": k + 1, "step_length": 0.1} | state)
    return {"consistency": runs, "consistency_steps": steps}


Maker = Callable[[str, int, np.random.Generator], Tables]
MAKERS: tuple[Maker, ...] = (
    checks,
    tolerance,
    unrolling,
    kink,
    horizon,
    inversion,
    regularization,
    consistency,
    identifiability,
    scaling,
)
