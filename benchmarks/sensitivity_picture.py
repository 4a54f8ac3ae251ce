"""A picture: where a stiff inclusion hides in the block, and where the gradient of the misfit points.

    python -m benchmarks.sensitivity_picture [FILE.png]          (needs matplotlib: pip install -e '.[pictures]')

The data are a twin's, read on the top of a block that holds the inclusion; the gradient is taken where nothing is
known, at E = 1. Negative dJ/dlogE asks for a stiffer cell.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

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


def draw(slice_: Slice, path: Path) -> None:
    """Both fields side by side, as PNG."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(8.4, 3.6), layout="constrained")
    largest = float(np.abs(slice_.sensitivity).max())
    panels = (
        (slice_.truth, "true E [Pa]", {"cmap": "cividis", "vmin": 0.0}),
        (slice_.sensitivity, "dJ/dlogE at E = 1 [m$^2$]", {"cmap": "RdBu", "vmin": -largest, "vmax": largest}),
    )
    for axis, (field, title, colours) in zip(axes, panels, strict=True):
        image = axis.imshow(field, origin="lower", extent=(0, 1, 0, 1), **colours)
        axis.set(title=title, xlabel="x [m]", ylabel="z [m]")
        figure.colorbar(image, ax=axis, shrink=0.9)
    figure.savefig(path, dpi=120, metadata={"Software": None})
    plt.close(figure)


def main() -> None:
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else FILE
    draw(slice_of(), path)
    print(f"drawn in {path}")


if __name__ == "__main__":
    main()
