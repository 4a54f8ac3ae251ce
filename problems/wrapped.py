"""A problem that changes another one: whatever it does not override is asked of that one."""

from __future__ import annotations

from collections.abc import Callable
from inspect import isfunction, signature
from typing import Any

from gradient_routes.problems.problem import Problem


class Forwarded:
    """The attribute `name` of the wrapped problem, unless the wrapper has its own."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __get__(self, wrapper: Wrapped | None, owner: type) -> Any:
        return self if wrapper is None else getattr(wrapper.problem, self.name)


def forwarded(name: str) -> Callable[..., Any]:
    """The method `name` of the wrapped problem, its argument p mapped by the wrapper's `p`."""
    declared = signature(getattr(Problem, name))

    def method(*args: Any, **options: Any) -> Any:
        given = declared.bind(*args, **options).arguments
        wrapper = given.pop("self")
        if "p" in given:
            given["p"] = wrapper.p(given["p"])
        return getattr(wrapper.problem, name)(**given)

    return method


class Wrapped(Problem):
    """`problem` with something changed. Law: a public attribute or method of Problem that a subclass does not define is
    that of `problem`, evaluated at p(c) where it takes parameters.

    A subclass overrides what its change affects: with fewer parameters all that has an axis of length n_p.
    """

    def __init_subclass__(cls, **options: Any) -> None:
        """Nothing is added to `offers`, which are those of `problem`."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    def p(self, c: Any) -> Any:
        """The parameters of `problem` at the parameters c of this one; traceable."""
        return c


for _name, _member in vars(Problem).items():
    if not _name.startswith("_"):
        setattr(Wrapped, _name, forwarded(_name) if isfunction(_member) else Forwarded(_name))
for _name in Problem.__annotations__:
    setattr(Wrapped, _name, Forwarded(_name))
