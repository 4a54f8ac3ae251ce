"""A Tesseract: springs of stiff moduli in a row, given in two groups, and what their names say is wrong with it."""

import numpy as np
from pydantic import BaseModel
from tesseract_core.runtime import Array, Differentiable, Float64

FAULT = "none"


class Group(BaseModel):
    E: Differentiable[Array[(None,), Float64]]  # [Pa]
    note: str = ""


class InputSchema(BaseModel):
    groups: list[Group]
    load: dict[str, Differentiable[Float64]]  # [N]


class Ends(BaseModel):
    u: Differentiable[Array[(None,), Float64]]  # [m]


class OutputSchema(BaseModel):
    sum: Differentiable[Float64]  # [m]
    ends: Ends
    steps: int


def parts(inputs):
    E = np.concatenate([group.E for group in inputs.groups])
    F = inputs.load["tip"]
    if (E < 0).any():
        raise ValueError(f"a modulus of {E.min():g} Pa")
    return E, F, np.cumsum(F / E)


def apply(inputs: InputSchema) -> OutputSchema:
    u = parts(inputs)[2]
    if FAULT == "nan":
        u = u * np.nan
    return OutputSchema(sum=u.sum(), ends=Ends(u=u), steps=1)


def matrix(inputs):
    """d(sum, u)/d(E, F)."""
    E, F, u = parts(inputs)
    u_E = np.tril(np.ones((len(E), len(E)))) * (-F / E**2)
    if FAULT == "sign":
        u_E[:, 1] *= -1.0
    u_p = np.column_stack([u_E, u / F])
    return np.vstack([u_p.sum(axis=0), u_p])


def names(inputs):
    """Paths of inputs and outputs, in the order of the matrix, and where each begins and ends."""
    sizes = [len(group.E) for group in inputs.groups]
    n = sum(sizes)
    ends = np.cumsum([0, *sizes])
    columns = {f"groups.[{k}].E": slice(ends[k], ends[k + 1]) for k in range(len(sizes))}
    return columns | {"load.{tip}": n}, {"sum": 0, "ends.u": slice(1, n + 1)}


def jacobian(inputs, jac_inputs, jac_outputs):
    A = matrix(inputs)
    columns, rows = names(inputs)
    return {y: {x: A[rows[y], columns[x]] for x in jac_inputs} for y in jac_outputs}


def vector_jacobian_product(inputs, vjp_inputs, vjp_outputs, cotangent_vector):
    A = matrix(inputs)
    columns, rows = names(inputs)
    w = np.zeros(len(A))
    for y in vjp_outputs:
        w[rows[y]] = cotangent_vector[y]
    if FAULT == "raises":
        raise ArithmeticError("the adjoint has not converged")
    return {x: (w @ A)[columns[x]] for x in vjp_inputs}


def jacobian_vector_product(inputs, jvp_inputs, jvp_outputs, tangent_vector):
    A = matrix(inputs)
    columns, rows = names(inputs)
    v = np.zeros(A.shape[1])
    for x in jvp_inputs:
        v[columns[x]] = tangent_vector[x]
    return {y: (A @ v)[rows[y]] for y in jvp_outputs}
