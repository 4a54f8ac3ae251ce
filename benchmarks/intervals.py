"""Do error bars hold what they promise? How often 95 % intervals cover the constants behind noisy data.

    python -m benchmarks.intervals [--seeds N]

Data of a plate in plane stress and of a coupon with many draws of noise, fitted by Gauss-Newton; the intervals are
p +- 1.96 sd.
Between 92 and 98 % is what 200 draws of a true 95 % give in 19 of 20 cases. Exit code 1 outside.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import click
import numpy as np

from gradient_routes.bench.cases import case
from gradient_routes.bench.inversion.invert import Engine, invert
from gradient_routes.bench.inversion.tradeoff import drawn

PROBLEMS = (
    "plate[n=4,law=linear,unknown=constants,data=twin,noise=1e-3,traction=0.1,sensors=everywhere]",
    "coupon[law=yeoh,mode=uniaxial+equibiaxial,modulus=1e6,noise=5e3]",
)
NORMAL = 1.96  # standard deviations to either side that hold 95 %
LEAST, MOST = 0.92, 0.98


def covered(problem: str, seeds: int) -> Iterator[tuple[str, np.ndarray]]:
    """Constant by constant: whether its interval held the truth, draw by draw."""
    (spec,), (route,) = case.problems([problem]), case.routes(["adjoint"])
    draws = drawn(spec, seeds)
    truth = draws[0].truth()
    assert truth is not None
    stated, found = draws[0].stated(truth), []
    for made in draws:
        made.measured = True  # as far as a fit can know
        ended = invert(spec, route, Engine("gauss-newton"), made=made)
        assert ended.fit is not None, ended.end
        constants = ended.fit.constants
        stating = () if constants is None else zip(constants.names, constants.value, constants.sd, strict=True)
        off = [abs(p - t) <= NORMAL * sd for p, t, sd in zip(ended.p, truth, ended.fit.sd, strict=True)]
        off += [abs(value - stated[name]) <= NORMAL * sd for name, value, sd in stating if name in stated]
        found.append(off)
    names = [*map(draws[0].parameters.label, range(len(truth))), *stated]
    yield from zip(names, np.transpose(found), strict=True)


@click.command()
@click.option("--seeds", type=click.IntRange(min=20), default=200, show_default=True)
def main(seeds: int) -> None:
    """Print how many intervals held the truth."""
    well = True
    for problem in PROBLEMS:
        click.echo(problem)
        for name, held in covered(problem, seeds):
            share = float(np.mean(held))
            well = well and LEAST <= share <= MOST
            click.echo(f"{name:8} {share:6.1%} of {seeds} intervals hold the truth")
    sys.exit(0 if well else 1)


if __name__ == "__main__":
    main()
