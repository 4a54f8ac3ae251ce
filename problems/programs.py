"""Functions as JAX traces them, so that what is compiled for one serves all that compute the same.

Problems are made anew for every command, and JAX compiles for a function, not for what it computes.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from copy import deepcopy
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from jax.extend.core import ClosedJaxpr, Jaxpr, Literal, jaxpr_as_fun

from gradient_routes.problems.jax64 import jax

Made = TypeVar("Made")
KEPT = 64  # of the latest
LARGEST = 10**6  # bytes of constants of what is kept
KNOWN = tuple(str(Path(file).parent) for file in (__file__, jax.__file__))
_kept: OrderedDict[Hashable, Any] = OrderedDict()


def program(f: Callable[..., Any], *arguments: Any) -> ClosedJaxpr:
    """What JAX traces of f, which returns one array, at arrays of these shapes and types."""
    return jax.make_jaxpr(f)(*arguments)


def shared(make: Callable[..., Made], kind: str, *programs: ClosedJaxpr | None) -> Made:
    """make(*functions) of the functions of these programs, or what it has made of equal ones.

    Their constants are copies: a problem that is changed afterwards changes nothing of what is kept.
    """
    if sum(np.asarray(constant).nbytes for one in programs if one for constant in one.consts) > LARGEST:
        return make(*(one and _function(one) for one in programs))
    key = kind, said(programs)
    if key not in _kept:
        _kept[key] = make(*(one and _function(_copied(one, {})) for one in programs))
        if len(_kept) > KEPT:
            _kept.popitem(last=False)
    _kept.move_to_end(key)
    return _kept[key]  # type: ignore[no-any-return]


def said(part: Any) -> Hashable:
    """All that a program, or a part of one, computes: equal where operations, shapes and constants are, to the last
    bit. One with a derivative that its author has given equals no other, as that is traced later.
    """
    if isinstance(part, ClosedJaxpr):
        return said(part.jaxpr), said(part.consts)
    if isinstance(part, Jaxpr):
        return _lines(part)
    if isinstance(part, (bool, int, float, complex)):
        return type(part), repr(part)  # 0.0 == -0.0
    if hasattr(part, "__array__"):
        array = np.asarray(part)
        return str(array.dtype), array.shape, array.tobytes()
    if isinstance(part, (tuple, list)):
        return type(part), tuple(said(each) for each in part)
    if isinstance(part, dict):
        return tuple((name, said(part[name])) for name in sorted(part))
    return part if isinstance(part, Hashable) else _Itself(part)


class _Itself:
    def __init__(self, part: Any) -> None:
        self.part = part

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Itself) and self.part is other.part

    def __hash__(self) -> int:
        return id(self.part)


def _lines(jaxpr: Any) -> Hashable:
    names: dict[Any, int] = {}

    def name(variable: Any) -> Hashable:
        if isinstance(variable, Literal):
            return said(variable.val), variable.aval
        return names.setdefault(variable, len(names)), variable.aval

    def line(eqn: Any) -> Hashable:
        if eqn.primitive.name.startswith("custom_") and not _known(eqn):
            return object()
        return eqn.primitive, *map(name, eqn.invars), said(eqn.params), *map(name, eqn.outvars)

    return tuple(map(name, (*jaxpr.constvars, *jaxpr.invars))), *map(line, jaxpr.eqns), *map(name, jaxpr.outvars)


def _known(eqn: Any) -> bool:
    """Whether a function with a derivative of its own is JAX's or of this package: these depend on nothing else."""
    value = eqn.params.get("call_jaxpr")
    return value is not None and str(value.jaxpr.debug_info.func_filename).startswith(KNOWN)


def _copied(part: Any, done: dict[int, Any]) -> Any:
    """With constants of its own; what occurs more than once remains one."""
    if isinstance(part, (tuple, list)):
        return type(part)(_copied(each, done) for each in part) if type(part) in (tuple, list) else part
    if isinstance(part, dict):
        return {name: _copied(value, done) for name, value in part.items()}
    if isinstance(part, (ClosedJaxpr, Jaxpr)) and id(part) not in done:
        given: Any = part
        if isinstance(part, ClosedJaxpr):
            consts = [deepcopy(constant) for constant in part.consts]  # of JAX's own types, which it needs
            done[id(part)] = given.replace(jaxpr=_copied(part.jaxpr, done), consts=consts)
        else:
            done[id(part)] = given.replace(eqns=[eqn.replace(params=_copied(eqn.params, done)) for eqn in part.eqns])
    return done.get(id(part), part)


def _function(one: ClosedJaxpr) -> Callable[..., Any]:
    several = jaxpr_as_fun(one)
    return lambda *arguments: several(*arguments)[0]
