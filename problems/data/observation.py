"""What is measured, beside what the state predicts of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array


@dataclass(frozen=True)
class Observation:
    """The data term of J: 1/2 |predicted - data|^2, with the weights of the sum in both.

    predicted (m,)     S u of a state, where p moves the sensors themselves S(u, p)
    data (m,)          what was measured
    S_u (m, n_u)       its derivative by u, sparse
    S_p (m, n_p)       by p with u held, None where there is none
    sigma              standard deviation of the noise on data, 0 where none is known
    label              (k) -> name of datum k
    weight             of a reading in that sum: what the rows, the data and sigma are multiplied by
    """

    predicted: Array
    data: Array
    S_u: Any
    S_p: Any = None
    sigma: float = 0.0
    label: Callable[[int], str] = str
    weight: float = 1.0


@dataclass(frozen=True)
class Candidates:
    """What a sensor could read, one unknown of the state each.

    at (k,)           their numbers
    label             (j) -> name of candidate j
    position (k, d)   where it is read [m], d <= 3; None where nowhere
    """

    at: Array
    label: Callable[[int], str]
    position: Array | None = None


def selection(at: Array, n: int, weight: float = 1.0) -> Any:
    """The sparse matrix (m, n) that reads the components `at` (m,), times a weight."""
    from scipy import sparse

    return sparse.csr_array((np.full(len(at), weight), (np.arange(len(at)), at)), shape=(len(at), n))
