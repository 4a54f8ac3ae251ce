"""A model behind UM-Bridge (protocol 1.0): F(p) and (dF/dp)^T w, its input and output blocks joined end to end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gradient_routes.bench.protocols.http import NoValue, Server
from gradient_routes.problems.errors import InputError, RoutesError
from gradient_routes.problems.problem import Array

VERSION = 1.0


class UMBridge:
    """The model `name` of the server at `url`, with `config`; the only one where the name is empty.

    Raises InputError for an unreachable server, another protocol version, a model that is not there or has no
    derivative.
    """

    def __init__(self, url: str, name: str, config: Mapping[str, Any]) -> None:
        self.server, self.who = Server(url), f"umbridge:{url}"
        self.model = {"name": self._known(name), "config": dict(config)}
        self.who += f"#{self.model['name']}"
        info = self._answer("ModelInfo", self.model)
        self.supports = [what for what, has in self._told(info, "ModelInfo", "support", dict).items() if has is True]
        if "Evaluate" not in self.supports or not {"Gradient", "ApplyJacobian"} & {*self.supports}:
            offers = ", ".join(self.supports) or "nothing"
            raise InputError(
                f"{self.who}: offers {offers} - a check needs Evaluate and Gradient, or ApplyJacobian in its place"
            )
        self.inputs, self.outputs = self._sizes("InputSizes"), self._sizes("OutputSizes")
        self.n_p = sum(self.inputs)
        start = info.get("start")  # those of `routes serve` tell it, and the names
        self.start = None if start is None else self._numbers(start, self.n_p, "start")
        self._names = info.get("names")

    @property
    def names(self) -> list[str] | None:
        """Of the components of p, by input where there are several; None where they are numbered."""
        if isinstance(self._names, list) and len(self._names) == self.n_p:
            return [*map(str, self._names)]
        if len(self.inputs) == 1:
            return None
        return [f"p_{j + 1}_{i + 1}" for j, size in enumerate(self.inputs) for i in range(size)]

    def value(self, p: Array) -> Array:
        """F(p), (m,). Raises NoValue."""
        blocks = self._asked("Evaluate", p)
        if not isinstance(blocks, list) or len(blocks) != len(self.outputs):
            raise self._odd("Evaluate", blocks, f"{len(self.outputs)} lists")
        numbered = enumerate(zip(blocks, self.outputs, strict=True))
        return np.concatenate([self._numbers(block, size, f"output {k + 1}") for k, (block, size) in numbered])

    @property
    def pushes(self) -> bool:
        """Whether it has products with dF/dp beside those with its transpose."""
        return {"Gradient", "ApplyJacobian"} <= {*self.supports}

    def pullback(self, p: Array, w: Array) -> Array:
        """(dF/dp)^T w, (n_p,), by n_p products with dF/dp where the model has those alone. Raises NoValue."""
        if "Gradient" not in self.supports:
            return np.array([w @ self.pushforward(p, e) for e in np.eye(self.n_p)])
        by_input = [np.zeros(size) for size in self.inputs]
        for i, w_i in enumerate(_split(w, self.outputs)):
            for j, size in enumerate(self.inputs):
                g = self._asked("Gradient", p, outWrt=i, inWrt=j, sens=w_i.tolist())
                by_input[j] += self._numbers(g, size, f"gradient of output {i + 1} by input {j + 1}")
        return np.concatenate(by_input)

    def pushforward(self, p: Array, v: Array) -> Array:
        """(dF/dp) v, (m,). Raises NoValue."""
        by_output = [np.zeros(size) for size in self.outputs]
        for i, size in enumerate(self.outputs):
            for j, v_j in enumerate(_split(v, self.inputs)):
                F_p_v = self._asked("ApplyJacobian", p, outWrt=i, inWrt=j, vec=v_j.tolist())
                by_output[i] += self._numbers(F_p_v, size, f"ApplyJacobian of output {i + 1} by input {j + 1}")
        return np.concatenate(by_output)

    def _known(self, name: str) -> str:
        info = self._answer("Info")
        version, names = info.get("protocolVersion"), info.get("models")
        if version != VERSION:
            raise InputError(f"{self.who}: speaks version {version} of UM-Bridge, this is {VERSION} - renew the server")
        known = [*map(str, names)] if isinstance(names, list) else []
        if name in known or (not name and len(known) == 1):
            return name or known[0]
        there = ", ".join(known) or "none"
        asked = f"no model '{name}'" if name else f"{len(known)} models"
        raise InputError(f"{self.who}: {asked} - there are {there}: give umbridge:URL#MODEL")

    def _sizes(self, endpoint: str) -> list[int]:
        answer = self._answer(endpoint, self.model)
        sizes: list[int] = self._told(answer, endpoint, f"{endpoint[0].lower()}{endpoint[1:]}", list)
        if not sizes or not all(isinstance(n, int) and not isinstance(n, bool) and n > 0 for n in sizes):
            raise InputError(f"{self.who}: {endpoint} are {sizes} - a check needs one block, of one number, at least")
        return sizes

    def _told(self, answer: dict[str, Any], endpoint: str, what: str, kind: type) -> Any:
        found = answer.get(what)
        if not isinstance(found, kind):
            raise InputError(f"{self.who}: {endpoint} tells no {what} - is it a server of UM-Bridge?")
        return found

    def _answer(self, endpoint: str, message: Any = None) -> dict[str, Any]:
        """Of what is asked before any p. Raises InputError."""
        try:
            answer = self.server.ask(endpoint, message)
        except NoValue as error:
            raise InputError(f"{self.who}: {error} - is it a server of UM-Bridge?") from None
        return answer if isinstance(answer, dict) else {}

    def _asked(self, endpoint: str, p: Array, **more: Any) -> Any:
        blocks = [block.tolist() for block in _split(p, self.inputs)]
        try:
            answer = self.server.ask(endpoint, {**self.model, "input": blocks, **more})
        except RoutesError as error:
            raise NoValue(str(error)) from None
        return answer.get("output") if isinstance(answer, dict) else answer

    def _numbers(self, values: Any, size: int, what: str) -> Array:
        """An array (size,) of finite numbers."""
        if not isinstance(values, list) or len(values) != size:
            raise self._odd(what, values, f"a list of {size} numbers")
        try:
            array = np.array([np.nan if value is None else value for value in values], np.float64)
        except (TypeError, ValueError, OverflowError):
            raise self._odd(what, values, "numbers") from None
        for k in np.flatnonzero(~np.isfinite(array))[:1]:
            raise NoValue(f"{what}, component {k + 1} is {'null' if values[k] is None else array[k]}")
        return array

    def _odd(self, what: str, value: Any, wanted: str) -> NoValue:
        given = f"a list of {len(value)}" if isinstance(value, list) else type(value).__name__
        return NoValue(f"{what} is {given}, not {wanted}: mend the model")


def _split(vector: Array, sizes: list[int]) -> list[Array]:
    return np.split(vector, np.cumsum(sizes)[:-1])
