"""The verbs as functions, for scripts and notebooks: arguments are named as the options, answers are values.

They compute in the calling process; nothing is printed, and nothing is kept unless a store is named. A problem is a
selector ("bar", "bar[n=64]", "model.py:Model") or a Problem, a route a selector or a Route.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, TypeVar, Unpack, get_args

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.cases.partial import chosen
from gradient_routes.bench.cases.row import STORED, as_record
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.bench.command_options import checked, solver_of
from gradient_routes.bench.store.frames import frame
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Problem
from gradient_routes.routes.route import Route

if TYPE_CHECKING:
    from pandas import DataFrame

    from gradient_routes.bench.inversion.optimizers import Name
    from gradient_routes.bench.inversion.result import Inversion
    from gradient_routes.bench.inversion.variables import Positive
    from gradient_routes.bench.studies.identify.identifiability import Identified
    from gradient_routes.bench.verification.result import Check
    from gradient_routes.routes.newton import Newton

OneProblem = str | Problem
OneRoute = str | Route
Spec = TypeVar("Spec", ProblemSpec, RouteSpec)


class SolverOptions(TypedDict, total=False):
    """Of the forward solve R(u, p) = 0.

    rtol           |R| relative to its start, 0 < rtol < 1 [1e-12]
    max_steps      Newton steps at most [50]
    linear_solver  "auto", "pardiso", "superlu", "cg-amg", "krylov" or "descent" ["auto"]
    newton         "full", "inexact": factors are kept and iterated with, or what costs less ["auto"]
    """

    rtol: float
    max_steps: int
    linear_solver: str
    newton: Newton


def run(
    problem: OneProblem | Sequence[OneProblem],
    route: OneRoute | Sequence[OneRoute] = "all",
    *,
    at: str = "start",
    components: int | None = None,
    directions: int | None = None,
    seed: int = 0,
    budget: float = 60.0,
    min_time: float = 0.1,
    timing: bool = True,
    store: Store | Path | str | None = None,
    **solver: Unpack[SolverOptions],
) -> DataFrame:
    """dJ/dp by every route named on every problem named: what each costs and how wrong it is. `routes run`.

    at          the p: "start", "true", values ("0.1,0,-0.3" or "log E_1=0.1,log E_3=-0.3") or a CSV file of one column
    components  only so many components of dJ/dp, drawn at random; `directions`: only slopes of J along so many
    seed        of these
    budget      gradients that are predicted to take more seconds are skipped
    min_time    seconds of steady calls to time; none where `timing` is False
    store       where rows are kept, too; for problems and routes named by selectors. A warning names the file of those
                that it did not take
    solver      options of the forward solve, see SolverOptions

    Returns one row a case, in the order asked for, with the columns that results/README.md describes: seconds, bytes,
    gradient_error = |g - g_ref| / |g_ref|, work counted and declared. A case that fails is a row with its `status` and
    `reason`. Cases run in this process: what a crash or an endless loop of foreign code may end, `routes run` isolates.

    >>> frame = run("bar[n=8|16]", ["tangent", "adjoint"], timing=False)
    >>> frame[["n_param", "route", "status", "work_solves", "work_transposed_solves"]]
       n_param    route status  work_solves  work_transposed_solves
    0        8  tangent     ok            9                       0
    1        8  adjoint     ok            1                       1
    2       16  tangent     ok           17                       0
    3       16  adjoint     ok            1                       1
    >>> bool((frame["gradient_error"] < 1e-14).all())
    True

    Raises InputError for what cannot be run, and where pandas is not installed (pip install 'gradient-routes[frames]').
    """
    from gradient_routes.bench.execution.sweep import run as run_cases
    from gradient_routes.bench.store.keeping import Keeper

    if not 0 <= min_time < float("inf"):
        raise InputError(f"run: min_time={min_time:g} - give seconds >= 0")
    problems, routes = _problems(problem), _routes(route)
    settings = Settings(
        at, checked(budget), min_time, timing, solver=solver_of(**solver), partial=chosen(components, directions, seed)
    )
    kept = store if isinstance(store, Store | None) else Store(store)
    if kept is not None:
        if not all(isinstance(named, str) for named in (*_each(problem), *_each(route))):
            raise InputError("run: a store keeps what can be named again - give problem and route as selectors")
        kept.check_writable()
    frame((), (), ())  # before anything is measured: pandas may be missing
    outcomes, keeper = [], Keeper(kept)
    try:
        for outcome in run_cases(problems, routes, settings):
            keeper.append(outcome.row, outcome.samples, outcome.environment)
            outcomes.append(outcome)
    finally:  # after an interrupt, too
        if apart := keeper.close():
            warnings.warn(f"run: {apart}", stacklevel=2)
    rows = [outcome.row for outcome in sorted(outcomes, key=lambda outcome: outcome.place)]
    return frame(STORED, [column.name for column in STORED], map(as_record, rows))


def vcurve(
    problem: OneProblem,
    route: OneRoute = "adjoint",
    *,
    at: str = "start",
    components: int | Sequence[int] = 3,
    directions: int = 2,
    steps: tuple[float, float] = (1e-16, 1.0),
    per_decade: int = 4,
    seed: int = 0,
    **solver: Unpack[SolverOptions],
) -> Check:
    """Difference quotients over decades of steps against the gradient of a route, and a verdict. `routes vcurve`.

    components  of p looked at one by one: so many, or these, counted from 0
    directions  random ones, of `seed`
    steps       least and largest h, relative to max(|p_i|, scale_i), `per_decade` of them in each decade

    Returns a Check: `verdict` ("agrees", "wrong-gradient", "solver-limited" ...), `says` why, with numbers, `todo`;
    `readings` holds the lines, with h, quotients and errors (n_h,) in `sweep`.

    >>> print(vcurve("bar", "adjoint").verdict)
    agrees
    >>> found = vcurve("bar", "faulty-adjoint[fault=sign]")
    >>> found.verdict, round(found.plateau, 3)
    ('wrong-gradient', 2.0)

    Raises InputError for what cannot be asked, and what building the problem raises.
    """
    from gradient_routes.bench.verification.check import check
    from gradient_routes.bench.verification.plan import Plan
    from gradient_routes.bench.verification.registered import subject

    looked_at = components if isinstance(components, int) else tuple(components)
    plan = Plan(*steps, per_decade, looked_at, directions, everywhere=True, budget=float("inf"), seed=seed)
    spec, way = _one(_problems(problem), problem), _one(_routes(route), route)
    with stdout_to_stderr():
        made = spec()
        return check(subject(made, way.route, way.options, case.point(made, at), solver_of(**solver)), plan)


def invert(
    problem: OneProblem,
    route: OneRoute = "adjoint",
    *,
    at: str = "start",
    optimizer: Name = "lbfgs",
    iterations: int = 200,
    tolerance: float = 1e-9,
    positive: Positive = "none",
    rate: float = 0.1,
    stop_at_noise: bool = False,
    **solver: Unpack[SolverOptions],
) -> Inversion:
    """Minimize J(p) = 1/2 |S u(p) - d|^2 + alpha Phi(p), from `at`, with any route as the engine. `routes invert`.

    optimizer   "lbfgs", "gauss-newton", "levenberg-marquardt", "trust", "descent" or "adam"; "linear": one linear
                solve, exact where u is linear in p
    iterations  at most; 0: the start
    tolerance   ends where |dJ/dp|, per natural change of p, is so much of its first, or of 1/2 |d|^2 (stiffness, rod)
    positive    "log" or "softplus": what keeps a raw parameter > 0
    rate        of adam's steps, in natural changes of p
    stop_at_noise  end at the first step that meets the data to their noise (discrepancy principle)

    Returns an Inversion: `p` and `gradient` (n_p,) at the end, `iterates` with J, misfit and the solves paid so far,
    `truth` where it is known, `end`: why it stopped, `misled`: whether the gradient is not that of J.

    >>> found = invert("bar", optimizer="gauss-newton")
    >>> found.end
    'converged: |dJ/dp| is 1e-09 of 1/2 |d|^2, confirmed by 4 forward solves'
    >>> float(abs(found.p - found.truth)[:5].max()) < 1e-6  # what lies behind the last sensor is not seen
    True

    Raises InputError for what cannot be asked, RoutesError where the route cannot run on the problem, and what the
    first evaluation of J raises.
    """
    from gradient_routes.bench.inversion.invert import Engine
    from gradient_routes.bench.inversion.invert import invert as minimize
    from gradient_routes.bench.inversion.optimizers import Limits, Name
    from gradient_routes.bench.inversion.variables import Positive

    _choice("invert: optimizer", optimizer, Name)
    _choice("invert: positive", positive, Positive)
    if iterations < 0 or not 0.0 <= tolerance < 1.0 or not 0.0 < rate < float("inf"):
        raise InputError(
            f"invert: iterations={iterations}, tolerance={tolerance:g}, rate={rate:g} - give iterations >= 0, a"
            " tolerance below 1 and a rate > 0"
        )
    engine = Engine(optimizer, Limits(iterations, tolerance, rate, stop_at_noise), solver_of(**solver), positive)
    return minimize(_one(_problems(problem), problem), _one(_routes(route), route), engine, at)


def identify(
    problem: OneProblem,
    *,
    at: str = "start",
    noise: float | None = None,
    modes: int | None = None,
    **solver: Unpack[SolverOptions],
) -> Identified:
    """What the data can say of p: singular values of H = d(S u)/dp against the noise. `routes identify`.

    noise  standard deviation of a reading, in the unit of the data [that of the problem]
    modes  so many singular values, by random products [all where H is affordable]

    Returns an Identified: `rank`, the singular values `svd.s`, `kinds` (n_p,) of "blind", "weak" or "seen",
    `posterior_sd` (n_p,) in the unit of each parameter.

    >>> found = identify("bar", noise=0.01)
    >>> found.rank, found.kinds.tolist()
    (5, ['seen', 'seen', 'seen', 'seen', 'seen', 'blind', 'blind', 'blind'])

    Raises InputError for what cannot be asked, and what the forward solve raises.
    """
    from gradient_routes.bench.studies.identify import identifiability

    return identifiability.identify(_one(_problems(problem), problem), at, noise, solver_of(**solver), modes)


def _each(given: Any) -> list[Any]:
    return [given] if isinstance(given, str | Problem | Route) else list(given)


def _problems(given: OneProblem | Sequence[OneProblem]) -> list[ProblemSpec]:
    """All that are named, grids expanded."""
    named = [case.problems([one]) if isinstance(one, str) else [_built(one)] for one in _each(given)]
    return _distinct(itertools.chain(*named), lambda spec: spec.build)


def _built(problem: Problem) -> ProblemSpec:
    """Of a problem that exists already; its source is that of its class."""
    build = lambda: problem  # noqa: E731 - an annotated function would have its annotations read as options
    build.__module__, build.__qualname__ = type(problem).__module__, type(problem).__qualname__
    return ProblemSpec(problem.name, {}, build)


def _routes(given: OneRoute | Sequence[OneRoute]) -> list[RouteSpec]:
    named = [
        case.routes([one]) if isinstance(one, str) else [RouteSpec(one.name, one, one.defaults)] for one in _each(given)
    ]
    return _distinct(itertools.chain(*named), lambda spec: spec.route)


def _distinct(specs: Iterable[Spec], code_of: Callable[[Spec], Any]) -> list[Spec]:
    """Each once. Raises InputError where two differ in their code only: rows could not be told apart."""
    found: dict[str, Spec] = {}
    for spec in specs:
        same = found.setdefault(repr((spec.name, spec.options)), spec)
        if code_of(same) is not code_of(spec):
            kind = "problems" if isinstance(spec, ProblemSpec) else "routes"
            raise InputError(f"{kind}: two are named '{spec.name}' - give each a name of its own")
    return list(found.values())


def _one(specs: Sequence[Spec], given: object) -> Spec:
    if len(specs) != 1:
        raise InputError(f"'{given}': names {len(specs)} - name one")
    return specs[0]


def _choice(what: str, given: str, literal: Any) -> None:
    """Raises InputError for a word that is not among those of a Literal."""
    if given not in get_args(literal):
        raise InputError(f"{what}={given} - {did_you_mean(given, get_args(literal))}")
