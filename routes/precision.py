"""The border at which arrays of a problem enter: float64 or complex128 from here on."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradient_routes.problems.errors import LowPrecision
from gradient_routes.problems.problem import Array

KNOWN = (np.dtype(np.float64), np.dtype(np.complex128))
HOW = "compute in float64 (JAX: jax.config.update('jax_enable_x64', True), PyTorch: dtype=torch.float64)"


def double(A: Any, what: str, who: str) -> Array:
    """An array, or a number, of float64 or complex128. Integers are converted, as sums into them would be truncated.

    Raises LowPrecision for numbers of fewer digits.
    """
    A = np.asarray(A)
    return A if A.dtype in KNOWN else np.asarray(A.astype(_target(A.dtype, what, who)))


def double_operator(A: Any, what: str, who: str) -> Any:
    """The same for a matrix of any kind; one without a dtype, given by its products, passes as it is."""
    dtype = getattr(A, "dtype", None)
    return A if dtype is None or dtype in KNOWN else A.astype(_target(np.dtype(dtype), what, who))


def _target(dtype: np.dtype[Any], what: str, who: str) -> type:
    complex_ = dtype.kind == "c"
    if dtype.kind in "biu" or (dtype.kind in "fc" and dtype.itemsize >= (16 if complex_ else 8)):
        return np.complex128 if complex_ else np.float64
    raise LowPrecision(f"{who}: {what} in {dtype} - {HOW}")
