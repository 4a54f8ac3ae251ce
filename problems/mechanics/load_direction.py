"""Where a load points: along an axis, a vector, or the normal of the face that carries it."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.facets import Facets
from gradient_routes.problems.problem import Array

FLAT = 1e-6  # of |n|: differences between the normals of a face that is flat


def load_direction(text: str, face: Facets, who: str) -> Array:
    """The unit vector (d,) of `x`, `-z`, `0,0.6,0.8` or `normal`, which points outward.

    Raises InputError, for the normal of a face that is not flat, too.
    """
    dim = face.geometry.dim
    axes = "xyz"[:dim]
    if text == "normal":
        return _normal(face, who)
    if text.lstrip("-") in tuple(axes):
        return np.asarray((-1.0 if text.startswith("-") else 1.0) * np.eye(dim)[axes.index(text[-1])])
    try:
        v = np.array([float(part) for part in text.split(",")])
    except ValueError:
        v = np.zeros(0)
    size = float(np.linalg.norm(v))
    if v.shape != (dim,) or not 0.0 < size < np.inf:
        raise InputError(
            f"{who}: direction={text} - give {', '.join(axes)}, normal, or {dim} numbers such as {('0,' * dim)[:-2]}-1"
        )
    return v / size


def _normal(face: Facets, who: str) -> Array:
    n = face.normals(face.geometry.X[face.nodes], np).reshape(-1, face.geometry.dim)
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    if np.ptp(n, axis=0).max() > FLAT:
        raise InputError(
            f"{who}: direction=normal: the loaded face is not flat - load a flat one, or take load=follower"
        )
    return np.asarray(n.mean(axis=0) / np.linalg.norm(n.mean(axis=0)))
