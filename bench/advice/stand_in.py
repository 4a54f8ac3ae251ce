"""A problem, its forward work and its prices made up from answers: what routes ask to know whether and at what cost."""

from __future__ import annotations

import numpy as np

from gradient_routes.bench.advice.answers import Answers, Measured
from gradient_routes.bench.cases.samples import Elapsed
from gradient_routes.bench.execution.cost_model import Prices
from gradient_routes.bench.execution.cost_model import prices as measured_prices
from gradient_routes.problems.problem import Array, Offers, Parameters, Problem
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.finite_difference import EPS
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.tally import Work

SHARE = 0.05  # of a Newton step: a solve with factors, measured on hexahedra (0.009 s of 0.45 s at 14 000 unknowns)
PRODUCT = 0.2  # of such a solve: a product with R_u
NOWHERE: Array = np.empty(0)  # a point: what routes ask here does not depend on p
NAME = "this problem"


class Steady(Problem):
    """It answers what it offers and how large it is, and evaluates nothing."""

    parameters = Parameters(NOWHERE, NOWHERE)
    estimated: float | None = None

    def condition(self, p: Array) -> float | None:
        return self.estimated


class March(Steady, Transient):
    """The same in time."""


def problem(answers: Answers) -> Problem:
    """What the answers say of a problem, for `Route.objection`, `expect` and `tape`."""
    made: Steady | March = March() if answers.steps else Steady()
    measured = answers.measured
    made.name = NAME if measured is None else measured.name
    made.offers, made.linear, made.steps = answers.offers, answers.linear, answers.steps
    made.n_state = answers.n_u * max(1, answers.steps)
    if measured is not None:
        made.structure, made.matrix_free = measured.structure, measured.matrix_free
        made.estimated = measured.condition
    return made


def model(answers: Answers) -> Model:
    """The same with the tolerance that forward work is declared for; its linear solver solves nothing."""
    return Model(problem(answers), Solver(rtol=prices(answers).declared.rtol, linear_solver="superlu"))


def prices(answers: Answers) -> Prices:
    """Measured ones, or those of full Newton steps by a direct solver.

    A further solve takes SHARE of a Newton step unless told; of a linear march, which is little else than solves, as
    long as the march.
    """
    if answers.measured is not None:
        return answers.measured.prices
    step = answers.forward_s / answers.newton
    solve = answers.solve_s or (step if answers.steps and answers.linear else SHARE * step)
    declared = ForwardWork(cold(answers), answers.linear, answers.rtol)
    return Prices(Elapsed(answers.forward_s, answers.forward_s), solve, PRODUCT * solve, declared)


def cold(answers: Answers) -> Work:
    """One forward solve. A linear march is one Newton step of all steps together."""
    if Offers.SOLVE not in answers.offers:
        return Work(forward_solves=1)
    if answers.linear:
        return Work(1, 1, 2, assemblies=1, factorizations=1, solves=1, steps=answers.steps)
    k, T = answers.newton, max(1, answers.steps)
    residuals = T * (k + 1) + (1 if answers.steps else 0)
    return Work(1, k * T, residuals, assemblies=k * T, factorizations=k * T, solves=k * T, steps=answers.steps)


def measured(of: Problem, p: Array, solver: Solver) -> Answers:
    """The answers for a problem at p (n_p,), by a few forward solves. Raises what these raise."""
    model = Model(of, solver)
    found, state = measured_prices(model, p)
    factors = None if state is None else int(state.factors.nbytes)
    known = Measured(of.name, found, of.structure, of.matrix_free, of.condition(p), factors)
    newton = found.declared.cold.newton_iterations
    steps = max(1, of.steps)
    return Answers(
        n_p=len(p),
        n_u=max(1, of.n_state // steps),
        steps=of.steps,
        newton=1 if of.linear else max(2, round(newton / steps)),
        offers=of.offers,
        smooth=state is None or of.active_set(state.u, p) is None,
        rtol=min(max(EPS, EPS if state is None else float(state.residual)), 0.5),
        forward_s=found.forward.wall,
        solve_s=found.solve or None,
        measured=known,
    )
