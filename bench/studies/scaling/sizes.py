"""The sizes of one problem: a grid of whole numbers that was asked for, or one of its options, climbing."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from gradient_routes.bench.cases.case import ProblemSpec
from gradient_routes.bench.cases.declared import declared_by
from gradient_routes.problems.errors import InputError, RoutesError

Count = Callable[[ProblemSpec], int]


@dataclass(frozen=True)
class Sizes:
    """Problems from small to large: equal but for `varied`, the names of options. `family` is what they share."""

    specs: tuple[ProblemSpec, ...]
    varied: tuple[str, ...]

    @property
    def family(self) -> dict[str, Any]:
        return {name: value for name, value in self.specs[0].options.items() if name not in self.varied}

    @property
    def in_time(self) -> bool:
        """Whether it is the steps of a march that vary, and nothing else."""
        return self.varied == ("steps",)

    def label(self, spec: ProblemSpec) -> str:
        return ",".join(f"{name}={spec.options[name]}" for name in self.varied) or spec.name

    def magnitude(self, spec: ProblemSpec) -> float:
        return float(math.prod(spec.options[name] for name in self.varied))


def unknowns(spec: ProblemSpec) -> int:
    """n_u. Raises InputError."""
    try:
        return spec().n_state
    except RoutesError:
        raise
    except Exception as failure:  # of a plug-in
        said = " ".join(str(failure).split())
        raise InputError(f"problem '{spec.name}' cannot be built: {type(failure).__name__}: {said} - mend it") from None


def sizes(
    specs: Sequence[ProblemSpec],
    first: int | None,
    growth: float,
    levels: int,
    count: Count = unknowns,
    axis: str | None = None,
) -> Sizes:
    """The grid as it is, or, of a single problem, `levels` of them over `axis`, n if it is not told, unknowns by
    `count`. Raises InputError.
    """
    if len(specs) == 1:
        return climb(specs[0], first, growth, levels, count, axis or "n")
    found = grid(specs)
    if axis is not None and found.varied != (axis,):
        raise InputError(f"--axis {axis}: the grid is one over {' and '.join(found.varied)} - leave one of them out")
    return found


def grid(specs: Sequence[ProblemSpec]) -> Sizes:
    """Several problems, which may differ in whole numbers only. Raises InputError."""
    name, options = specs[0].name, specs[0].options
    if any(spec.name != name for spec in specs):
        raise InputError(f"scaling: {', '.join(dict.fromkeys(s.name for s in specs))} - name one problem")
    varied = tuple(key for key in options if len({repr(spec.options[key]) for spec in specs}) > 1)
    for key in varied:
        values = [spec.options[key] for spec in specs]
        wrong = [v for v in values if isinstance(v, bool) or not isinstance(v, int) or v < 1]
        if wrong:
            raise InputError(f"{name}: {key}={wrong[0]} is no size - sizes are whole numbers >= 1; take one {key}")
    of = Sizes(tuple(specs), varied)
    return replace(of, specs=tuple(sorted(specs, key=of.magnitude)))


def climb(spec: ProblemSpec, first: int | None, growth: float, levels: int, count: Count, axis: str = "n") -> Sizes:
    """n, or another axis, such that the unknowns grow by `growth` a level, from `first` or the n given.

    Raises InputError.
    """
    if levels == 1 and first is None and axis == "n":
        return Sizes((spec,), ("n",) if "n" in spec.options else ())
    start = _start(spec, first, axis)
    if levels == 1:
        return Sizes((_sized(spec, axis, start),), (axis,))
    per_n = _dimension(spec, axis, start, count)
    ns = [start]
    for level in range(1, levels):
        ns.append(max(ns[-1] + 1, round(start * growth ** (level / per_n))))
    return Sizes(tuple(_sized(spec, axis, n) for n in ns), (axis,))


def _start(spec: ProblemSpec, first: int | None, axis: str) -> int:
    option = declared_by(spec.build).options.get(axis)
    if option is None or int not in option.kinds:
        grid = f"'{spec.name}[KEY=1|2|4]'"
        raise InputError(
            f"{spec.name}: has no whole number {axis} to climb by - give a grid: {grid}, or another --axis"
        )
    start = spec.options[axis] if first is None else first
    if start is None or start < 1:
        raise InputError(f"{spec.name}: {axis}={start} is no size - say where to begin: --from N")
    return int(start)


def _sized(spec: ProblemSpec, axis: str, n: int) -> ProblemSpec:
    return replace(spec, options=spec.options | {axis: n})


def _dimension(spec: ProblemSpec, axis: str, n: int, count: Count) -> float:
    """d of n_u ~ n^d, by what twice as much n gives."""
    few, many = (count(_sized(spec, axis, size)) for size in (n, 2 * n))
    if few >= many:
        raise InputError(
            f"{spec.name}: {axis}={n} has {few} unknowns, {axis}={2 * n} has {many} - give a grid of sizes"
        )
    return math.log2(many / few)
