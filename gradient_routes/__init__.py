"""Gradients of PDE-constrained objectives: every route to dJ/dp, its cost and its error.

What `__all__` names is the public interface. Everything else is private and may change without notice.

check, assert_gradient      is this gradient right? for any code
run, vcurve                 routes on problems: cost and error; one route under step sizes over decades
invert, identify            minimize J by a route; what the data can say of p
Store                       what is kept
Problem, Parameters ...     to write a problem: R(u, p), J(u, p) and their partial derivatives
Transient                   to write one that marches in time, by its step
Route, route ...            to write a route: from p to (J, dJ/dp)
Study, Table, Column ...    to write a study: a question, its options, what it keeps and shows
RoutesError ...             what is raised on purpose, one line each

A problem of one's own, k u + c u^3 = 1 and J = (u - 0.5)^2 / 2 with p = (k, c), by two routes:

>>> import numpy as np
>>> from gradient_routes import Linearization, Offers, Parameters, Problem, run, vcurve
>>> class Spring(Problem):
...     name, n_state = "spring", 1
...     offers = Offers.LINEARIZE | Offers.COMPLEX
...     parameters = Parameters(start=[1.0, 2.0], scale=[1.0, 1.0], lower=0.0, unit=("N/m", "N/m^3"))
...
...     def residual(self, u, p):
...         return p[0] * u + p[1] * u**3 - 1.0
...
...     def tangent(self, u, p):
...         return np.array([[p[0] + 3.0 * p[1] * u[0] ** 2]])
...
...     def objective(self, u, p):
...         return 0.5 * (u[0] - 0.5) ** 2
...
...     def linearize(self, u, p):
...         return Linearization(R_p=np.array([[u[0], u[0] ** 3]]), J_u=u - 0.5, J_p=np.zeros(2))
>>> run(Spring(), ["adjoint", "fd-central"], timing=False)[["route", "status", "reference", "work_forward_solves"]]
        route status     reference  work_forward_solves
0     adjoint     ok  complex-step                    1
1  fd-central     ok  complex-step                    4
>>> vcurve(Spring(), "adjoint").verdict
'agrees'
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gradient_routes.bench.api import identify as identify
    from gradient_routes.bench.api import invert as invert
    from gradient_routes.bench.api import run as run
    from gradient_routes.bench.api import vcurve as vcurve
    from gradient_routes.bench.cases.column import Column as Column
    from gradient_routes.bench.cases.column import Table as Table
    from gradient_routes.bench.cases.study import Found as Found
    from gradient_routes.bench.cases.study import Kept as Kept
    from gradient_routes.bench.cases.study import Note as Note
    from gradient_routes.bench.cases.study import Rule as Rule
    from gradient_routes.bench.cases.study import Say as Say
    from gradient_routes.bench.cases.study import Study as Study
    from gradient_routes.bench.command_options import at_option as at_option
    from gradient_routes.bench.store.store import Store as Store
    from gradient_routes.bench.studies.options import problem_at as problem_at
    from gradient_routes.bench.studies.options import problem_option as problem_option
    from gradient_routes.bench.verification.api import assert_gradient as assert_gradient
    from gradient_routes.bench.verification.api import check as check
    from gradient_routes.problems.errors import DomainError as DomainError
    from gradient_routes.problems.errors import InputError as InputError
    from gradient_routes.problems.errors import NotConverged as NotConverged
    from gradient_routes.problems.errors import RoutesError as RoutesError
    from gradient_routes.problems.problem import Array as Array
    from gradient_routes.problems.problem import Linearization as Linearization
    from gradient_routes.problems.problem import Offers as Offers
    from gradient_routes.problems.problem import Parameters as Parameters
    from gradient_routes.problems.problem import Problem as Problem
    from gradient_routes.problems.problem import Traced as Traced
    from gradient_routes.problems.transient import Transient as Transient
    from gradient_routes.routes.forward_work import ForwardWork as ForwardWork
    from gradient_routes.routes.model import Model as Model
    from gradient_routes.routes.route import Result as Result
    from gradient_routes.routes.route import Route as Route
    from gradient_routes.routes.route import route as route
    from gradient_routes.routes.tally import Work as Work

PUBLIC = {  # name -> the module that defines it, imported when the name is first used
    "Array": "gradient_routes.problems.problem",
    "Column": "gradient_routes.bench.cases.column",
    "DomainError": "gradient_routes.problems.errors",
    "ForwardWork": "gradient_routes.routes.forward_work",
    "Found": "gradient_routes.bench.cases.study",
    "InputError": "gradient_routes.problems.errors",
    "Kept": "gradient_routes.bench.cases.study",
    "Linearization": "gradient_routes.problems.problem",
    "Model": "gradient_routes.routes.model",
    "NotConverged": "gradient_routes.problems.errors",
    "Note": "gradient_routes.bench.cases.study",
    "Offers": "gradient_routes.problems.problem",
    "Parameters": "gradient_routes.problems.problem",
    "Problem": "gradient_routes.problems.problem",
    "Result": "gradient_routes.routes.route",
    "Route": "gradient_routes.routes.route",
    "Rule": "gradient_routes.bench.cases.study",
    "RoutesError": "gradient_routes.problems.errors",
    "Say": "gradient_routes.bench.cases.study",
    "Store": "gradient_routes.bench.store.store",
    "Study": "gradient_routes.bench.cases.study",
    "Table": "gradient_routes.bench.cases.column",
    "Traced": "gradient_routes.problems.problem",
    "Transient": "gradient_routes.problems.transient",
    "Work": "gradient_routes.routes.tally",
    "assert_gradient": "gradient_routes.bench.verification.api",
    "at_option": "gradient_routes.bench.command_options",
    "check": "gradient_routes.bench.verification.api",
    "identify": "gradient_routes.bench.api",
    "invert": "gradient_routes.bench.api",
    "problem_at": "gradient_routes.bench.studies.options",
    "problem_option": "gradient_routes.bench.studies.options",
    "route": "gradient_routes.routes.route",
    "run": "gradient_routes.bench.api",
    "vcurve": "gradient_routes.bench.api",
}
__all__ = list(PUBLIC)


def __getattr__(name: str) -> Any:
    if name in PUBLIC:
        return getattr(import_module(PUBLIC[name]), name)
    raise AttributeError(f"module 'gradient_routes' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *PUBLIC})
