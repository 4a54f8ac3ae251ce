"""Rows of what the data can say: spectra, parameters, experiments compared, sensors proposed; and fields on a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.studies.identify.identifiability import Identified
from gradient_routes.bench.studies.identify.placement import Placement
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Fields


def rows(experiments: Sequence[Identified], placement: Placement | None) -> dict[str, list[Row]]:
    """By table. The first experiment is what the others are compared with."""
    tables = {
        "spectrum": [row for one in experiments for row in _spectrum(one)],
        "identified": [row for one in experiments for row in _parameters(one)],
        "experiments": [_experiment(one, experiments[0]) for one in experiments],
    }
    return tables if placement is None else tables | {"placement": _placement(experiments[0], placement)}


def _shared(one: Identified) -> Row:
    return {
        "problem": one.spec.name,
        "problem_options": one.spec.options,
        "at": one.at,
        "n_state": one.problem.n_state,
        "n_param": len(one.state.p),
        "experiment": one.spec.selector,
    }


def _spectrum(one: Identified) -> list[Row]:
    shared = _shared(one)
    return [
        shared
        | {
            "index_": k,
            "singular_value": float(s),
            "relative_to_noise": float(s) / one.sigma if one.sigma else None,
            "identifiable": int(identifiable),
        }
        for k, (s, identifiable) in enumerate(zip(one.svd.s, one.identifiable, strict=True), start=1)
    ]


def _parameters(one: Identified) -> list[Row]:
    shared, parameters = _shared(one), one.problem.parameters
    kinds, null_share = one.kinds, one.null_share
    return [
        shared
        | {"parameter": parameters.label(i), **_place(parameters.position, i)}
        | {
            "column_norm": float(one.svd.norms[i]),
            "kind": str(kinds[i]),
            "null_share": float(null_share[i]),
            "posterior_sd": _finite(one.posterior_sd[i]),
            "prior_sd": None if one.prior_sd is None else _finite(one.prior_sd[i]),
        }
        for i in range(len(parameters))
    ]


def _experiment(one: Identified, first: Identified) -> Row:
    kinds = one.kinds
    return _shared(one) | {
        "data": one.data,
        "sigma": one.sigma or None,
        "rank": one.rank,
        "blind": int((kinds == "blind").sum()),
        "weak": int((kinds == "weak").sum()),
        "gained": one.rank - first.rank,
    }


def _placement(one: Identified, placement: Placement) -> list[Row]:
    shared = _shared(one) | {"criterion": placement.criterion}
    return [
        shared
        | {"step": step, "sensor": choice.sensor, **_place(choice.position, None)}
        | {"value": choice.value, "rank": choice.rank}
        for step, choice in enumerate(placement.choices, start=1)
    ]


def fields(one: Identified) -> Fields:
    """u, and what is known of each cell's parameter. Raises InputError where cells have none of their own."""
    problem, p = one.problem, one.state.p
    mesh = problem.fields(p, one.state.u, None, np.zeros_like(p))
    if mesh is None or len(mesh.cells) != len(p):
        what = "has no mesh" if mesh is None else f"{len(p)} parameters on {len(mesh.cells)} cells"
        raise InputError(f"--vtu: {problem.name}: {what} - take a problem with one parameter a cell")
    known = {"null_share": one.null_share, "column_norm": one.svd.norms, "posterior_sd": one.posterior_sd}
    own = {name: values for name, values in mesh.cell_data.items() if not name.startswith("dJ_")}
    return replace(mesh, cell_data=own | known)


def _place(x: Array | None, i: int | None) -> dict[str, Any]:
    """x, y, z of a point, or of the i-th; what it lacks is None."""
    at = [] if x is None else (x if i is None else x[i]).tolist()
    return dict(zip("xyz", [*at, None, None, None], strict=False))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
