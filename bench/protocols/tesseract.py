"""A Tesseract, from its source or at a URL: its differentiable inputs are p, its differentiable outputs F(p).

tesseract-core speaks to it: from a source it is run in this process, without a container; over HTTP arrays travel as
base64.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.protocols.http import NoValue, Server
from gradient_routes.bench.protocols.pytree import Leaf, decoded, leaves, replaced
from gradient_routes.bench.verification.guarded import FOREIGN
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array
from gradient_routes.problems.text import shortened

SOURCE = "tesseract_api.py"
VJP, JVP, JACOBIAN = "vector_jacobian_product", "jacobian_vector_product", "jacobian"
VERSION = "1.15"
BEHIND = "Error running Tesseract API "  # a traceback, as tesseract-core writes it


class TesseractModel:
    """The Tesseract at `address` with the payload of its apply, {"inputs": {...}}: p starts at those inputs.

    Raises InputError for a missing package, file or server, inputs that it does not take, and for one that has no
    derivative.
    """

    def __init__(self, address: str, payload: Mapping[str, Any] | None) -> None:
        self.who = f"tesseract:{address}"
        self.tesseract = _opened(address, self.who)
        schemas = self.tesseract.openapi_schema.get("components", {}).get("schemas", {})
        patterns = [schemas.get(f"Apply{side}Schema", {}).get("differentiable_arrays") for side in ("Input", "Output")]
        if None in patterns:
            raise InputError(
                f"{self.who}: does not tell what is differentiable - build it with tesseract-core {VERSION}"
            )
        self._outputs = patterns[1]
        self.endpoints = [name for name in self.tesseract.available_endpoints if name in (VJP, JVP, JACOBIAN)]
        if not self.endpoints:
            raise InputError(f"{self.who}: has no derivatives - a check needs {VJP}, {JACOBIAN} or {JVP}")
        inputs = (payload or {}).get("inputs")
        if not isinstance(inputs, dict):
            raise InputError(
                f'{self.who}: no inputs - give --config FILE.json, the payload of apply, {{"inputs": {{..}}}}'
            )
        try:
            self.inputs = decoded(inputs)
            self.p = [leaf for pattern in patterns[0] for leaf in leaves(pattern, self.inputs)]
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{self.who}: an array of the inputs cannot be read: {error} - correct it") from None
        if not self.p:
            raise InputError(f"{self.who}: no differentiable input, {' '.join(patterns[0])}, is given - give one")
        self.start = np.concatenate([leaf.value.ravel() for leaf in self.p])
        self.n_p = len(self.start)
        self.names = [name for leaf in self.p for name in leaf.components()]

    def value(self, p: Array) -> Array:
        """F(p), (m,). Raises NoValue."""
        return np.concatenate([leaf.value.ravel() for leaf in self._F(p)])

    @property
    def pushes(self) -> bool:
        """Whether it has products with dF/dp beside those with its transpose."""
        return VJP in self.endpoints and len(self.endpoints) > 1

    def pullback(self, p: Array, w: Array) -> Array:
        """(dF/dp)^T w, (n_p,); of the jacobian, or of n_p products, where it has no other. Raises NoValue."""
        if JACOBIAN in self.endpoints and VJP not in self.endpoints:
            return np.asarray(self._jacobian(p).T @ w)
        if VJP not in self.endpoints:
            return np.array([w @ self.pushforward(p, e) for e in np.eye(self.n_p)])
        F = self._F(p)
        cotangent = dict(zip((leaf.path for leaf in F), _split(w, F), strict=True))
        inputs, outputs = [leaf.path for leaf in self.p], [*cotangent]
        found = self._ask(VJP, p, vjp_inputs=inputs, vjp_outputs=outputs, cotangent_vector=cotangent)
        return np.concatenate([_numbers(found, leaf.path, leaf.value.shape, VJP).ravel() for leaf in self.p])

    def pushforward(self, p: Array, v: Array) -> Array:
        """(dF/dp) v, (m,). Raises NoValue."""
        if JVP not in self.endpoints:
            return np.asarray(self._jacobian(p) @ v)
        F, tangent = self._F(p), dict(zip((leaf.path for leaf in self.p), _split(v, self.p), strict=True))
        inputs, outputs = [*tangent], [leaf.path for leaf in F]
        found = self._ask(JVP, p, jvp_inputs=inputs, jvp_outputs=outputs, tangent_vector=tangent)
        return np.concatenate([_numbers(found, leaf.path, leaf.value.shape, JVP).ravel() for leaf in F])

    def _jacobian(self, p: Array) -> Array:
        """dF/dp (m, n_p)."""
        F = self._F(p)
        inputs, outputs = [leaf.path for leaf in self.p], [leaf.path for leaf in F]
        found = self._ask(JACOBIAN, p, jac_inputs=inputs, jac_outputs=outputs)
        return np.block(
            [
                [
                    _numbers(found.get(y.path), x.path, y.value.shape + x.value.shape, JACOBIAN).reshape(
                        y.value.size, -1
                    )
                    for x in self.p
                ]
                for y in F
            ]
        )

    def _F(self, p: Array) -> list[Leaf]:
        """The differentiable outputs, finite."""
        outputs = self._ask("apply", p)
        try:
            F = [leaf for pattern in self._outputs for leaf in leaves(pattern, outputs)]
        except (KeyError, TypeError, ValueError) as error:
            raise NoValue(f"apply: an output is no array of numbers: {error}") from None
        if not F:
            raise NoValue("apply: returns no differentiable output")
        for leaf in F:
            _finite(leaf.value, f"apply: {leaf.path}")
        return F

    def _ask(self, endpoint: str, p: Array, **more: Any) -> Any:
        values = zip(self.p, _split(p, self.p), strict=True)
        inputs = replaced(copy.deepcopy(self.inputs), ((leaf.keys, value) for leaf, value in values))
        try:
            return getattr(self.tesseract, endpoint)(inputs=inputs, **more)
        except FOREIGN as failure:
            said = _said(failure).removeprefix(f"{endpoint}: ")
            raise NoValue(f"{endpoint}: {said}") from failure


def _opened(address: str, who: str) -> Any:
    try:
        from tesseract_core import Tesseract
    except ImportError as error:
        raise InputError(f"{who}: {error} - pip install 'gradient-routes[tesseract]'") from None
    if address.startswith(("http://", "https://")):
        try:
            Server(address).ask("health")
            return Tesseract.from_url(address).with_encoding(output_format="json+base64")  # plain JSON has no inf
        except InputError:
            raise
        except FOREIGN as failure:
            raise InputError(f"{who}: {_said(failure)} - is it a Tesseract?") from failure
    path = located(address)
    path = path / SOURCE if path.is_dir() else path
    if not path.is_file():
        raise InputError(f"{who}: no file {path.name} there - give a {SOURCE}, its folder, or http://HOST:PORT")
    try:
        return Tesseract.from_tesseract_api(path)
    except FOREIGN as failure:
        cause = _root(failure)
        raise InputError(f"{who}: cannot be loaded: {type(cause).__name__}: {_said(cause)} - mend it") from failure


def _said(failure: BaseException) -> str:
    """The model's own words, which stand behind a traceback."""
    text = str(failure).rpartition(BEHIND)[2].strip() or type(failure).__name__
    return shortened(" ".join(text.removesuffix("(see above for full traceback)").split()))


def _root(failure: BaseException) -> BaseException:
    """What it comes from."""
    cause = failure.__cause__ or failure.__context__
    return failure if cause is None else _root(cause)


def _split(vector: Array, of: list[Leaf]) -> Iterator[Array]:
    """By leaves, each of its shape."""
    parts = np.split(vector, np.cumsum([leaf.value.size for leaf in of])[:-1])
    return (part.reshape(leaf.value.shape) for part, leaf in zip(parts, of, strict=True))


def _numbers(found: Any, path: str, shape: tuple[int, ...], endpoint: str) -> Array:
    value = found.get(path) if isinstance(found, dict) else None
    if value is None:
        raise NoValue(f"{endpoint}: returns nothing for {path}: mend the model")
    array = np.asarray(value, np.float64)
    if array.shape != shape:
        raise NoValue(f"{endpoint}: {path} has the shape {array.shape}, not {shape}: mend the model")
    return _finite(array, f"{endpoint}: {path}")


def _finite(array: Array, what: str) -> Array:
    bad = array[~np.isfinite(array)]
    if bad.size:
        raise NoValue(f"{what} is {bad[0]} in {bad.size} of {array.size} components")
    return array
