"""Columns of du/dp and d(S u)/dp: as numbers, and as fields on the mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gradient_routes.bench.cases.outcome import Sensitivities
from gradient_routes.bench.cases.settings import Columns
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Fields, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State
from gradient_routes.routes.sensitivity import state_sensitivity

ADJOINT = "lambda"  # fields of this name, where a problem numbers its load cases with a suffix


def check_columns(columns: Columns, name: str, n_p: int) -> None:
    """Raises InputError for parameters that there are not."""
    last = max(columns.chosen or (0,))
    if last >= n_p:
        raise InputError(f"--columns {last + 1}: {name} has {n_p} parameters - choose 1 to {n_p}")


def sensitivities(model: Model, state: State, columns: Columns) -> Sensitivities:
    """At a solved state. Raises InputError where the problem observes nothing."""
    parameters, chosen = model.problem.parameters, _chosen(columns, len(state.p))
    du_dp = state_sensitivity(model, state, chosen)
    labels, units = [parameters.label(i) for i in chosen], [parameters.unit_of(i) for i in chosen]
    if columns.of == "state":
        return Sensitivities("du_dp", [f"u_{i + 1}" for i in range(len(state.u))], labels, units, du_dp)
    seen = model.problem.observation(state.u, state.p)
    if seen is None:
        raise InputError(f"{model.problem.name}: has no observation S u - give --sensitivities-of state")
    seen = seen.whole or seen  # readings move, whatever J eliminates from them
    values = seen.S_u @ du_dp
    if seen.S_p is not None:
        values = values + seen.S_p @ np.eye(len(state.p))[:, chosen]
    values = values / np.reshape(seen.weight * seen.relative, (-1, 1))
    return Sensitivities("dSu_dp", [*map(seen.label, range(len(seen.data)))], labels, units, values)


def with_columns(fields: Fields, problem: Problem, state: State | None, model: Model, columns: Columns) -> Fields:
    """Fields and, beside them, du/dp_i at every point for the parameters chosen: `du_dp_1` and so on."""
    if state is None:
        return fields
    chosen = _chosen(columns, len(state.p))
    point_data = dict(fields.point_data)
    for i, du in zip(chosen, state_sensitivity(model, state, chosen).T, strict=True):
        point_data |= _column(problem, state, i, du)
    return replace(fields, point_data=point_data)


def _column(problem: Problem, state: State, i: int, du: Array) -> dict[str, Array]:
    """du/dp_i: that of the unknowns as the adjoint state is drawn, and that of prescribed values, affine in p."""
    step = np.zeros_like(state.p)
    lower, upper = problem.parameters.bounds(i)
    size = float(problem.parameters.scale[i])
    step[i] = size if state.p[i] + size < upper else -min(size, (state.p[i] - lower) / 2)
    here, there = (_points(problem, p, state.u, du) for p in (state.p, state.p + step))
    return {
        f"du_dp_{i + 1}{suffix}": here[ADJOINT + suffix] + (there["u" + suffix] - here["u" + suffix]) / step[i]
        for suffix in (name.removeprefix(ADJOINT) for name in here if name.startswith(ADJOINT))
    }


def _points(problem: Problem, p: Array, u: Array, du: Array) -> dict[str, Array]:
    fields = problem.fields(p, u, du, np.zeros_like(p))
    return {} if fields is None else dict(fields.point_data)


def _chosen(columns: Columns, n_p: int) -> list[int]:
    return [*range(n_p)] if columns.chosen is None else [*columns.chosen]
