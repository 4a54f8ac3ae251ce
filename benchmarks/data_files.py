"""A million measured points on a block of n = 12: seconds and memory to read them and to find their cells.

python -m benchmarks.data_files
"""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from gradient_routes.bench.units import duration
from gradient_routes.problems.data.probes import groups, read_probes
from gradient_routes.problems.data.table import read_table
from gradient_routes.problems.fem.mesh import box_mesh

POINTS, CELLS = 1_000_000, 12
SECONDS, MEBIBYTES = 5.0, 500.0  # to be reached


def main() -> None:
    mesh = box_mesh("block", "hex8", (CELLS,) * 3, (1.0, 1.0, 1.0))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "points.csv"
        with open(path, "w") as file:
            file.write("x [mm],y [mm],z [mm],ux (um),uy (um),uz (um)\n")
            for seed in range(20):
                rows = 1e3 * np.random.default_rng(seed).uniform(size=(POINTS // 20, 6))
                np.savetxt(file, rows, fmt="%.7g", delimiter=",")
        for what, read in (
            ("read", lambda: read_table(path, groups("xyz"))),
            ("read and located", lambda: read_probes(mesh, str(path))),
        ):
            wall, cpu = time.perf_counter(), time.process_time()
            read()
            took = f"{duration(time.perf_counter() - wall)}, of the processor {duration(time.process_time() - cpu)}"
            print(f"{POINTS:,} points {what}: {took}")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak of the process {peak:.0f} MiB; to be reached: {SECONDS:g} s, {MEBIBYTES:g} MiB")


if __name__ == "__main__":
    main()
