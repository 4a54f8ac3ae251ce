"""A picture: where a stiff inclusion hides in the block, and where the gradient of the misfit points.

    python -m benchmarks.sensitivity_picture [FILE.png]          (needs vl-convert: pip install -e '.[pictures]')

The data are a twin's, read on the top of a block that holds the inclusion; the gradient is taken where nothing is
known, at E = 1. Negative dJ/dlogE asks for a stiffer cell.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gradient_routes.bench.render.figure import Axis, Figure, Table
from gradient_routes.bench.render.picking import real
from gradient_routes.bench.render.vega import CONFIG, records, spec
from gradient_routes.problems.block import Block
from gradient_routes.problems.problem import Array
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.synthetic_data import with_synthetic_data

FILE = Path("results") / "block_sensitivity.png"


@dataclass(frozen=True)
class Slice:
    """Of the layer behind the middle of a box of n x n x n cells, rows bottom to top: (n, n) each.

    truth        E that made the data [Pa]
    sensitivity  dJ/dlogE at E = 1 [m^2]
    """

    truth: Array
    sensitivity: Array


def slice_of(n: int = 12) -> Slice:
    """The gradient by the adjoint route, cell by cell, at y = 1/2 or just behind."""
    block = with_synthetic_data(Block(n=n, data="twin"))
    p = block.parameters.start
    gradient = adjoint.prepare(Model(block), p)(p).gradient
    truth, position = block.truth(), block.parameters.position
    assert truth is not None
    assert position is not None
    x, y, z = position.T
    plane = np.flatnonzero(np.isclose(y, (n // 2 + 0.5) / n))
    order = plane[np.lexsort((x[plane], z[plane]))]
    return Slice(np.exp(truth[order]).reshape(n, n), gradient[order].reshape(n, n))


def figure(slice_: Slice, quantity: str, label: str) -> Figure:
    """One of the two fields, cell by cell, over x and z."""
    n = len(slice_.truth)
    rows = [
        {"x": (k + 0.5) / n, "z": (j + 0.5) / n, "side": 1 / n, quantity: getattr(slice_, quantity)[j, k]}
        for j in range(n)
        for k in range(n)
    ]
    table = Table.of([real(name, "", "") for name in ("x", "z", "side", quantity)], rows)
    x, z = (Axis(name, name, "m") for name in "xz")
    of = {"fold": {quantity: label}, "panels": ("at y = 1/2",) * len(rows), "sides": ("side", "side")}
    return Figure(quantity, label, "", table, "cells", (x,), (z,), z=Axis(quantity, label), **of)


def draw(slice_: Slice, path: Path) -> None:
    """Both fields side by side, each with its own colours, as PNG."""
    import vl_convert

    panels = [figure(slice_, "truth", "E [Pa]"), figure(slice_, "sensitivity", "dJ/dlogE at E = 1 [m²]")]
    drawn = [spec(each) | {"data": {"values": records(each)}} for each in panels]
    for each in drawn:
        each.pop("config")
    whole = {"hconcat": drawn, "config": CONFIG, "resolve": {"scale": {"color": "independent"}}}
    path.write_bytes(vl_convert.vegalite_to_png(whole, scale=2))


def main() -> None:
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else FILE
    draw(slice_of(), path)
    print(f"drawn in {path}")


if __name__ == "__main__":
    main()
