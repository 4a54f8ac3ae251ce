"""What the adapter protocol costs a call: a gradient of an adapter that computes nothing, at three sizes of p.

python -m benchmarks.adapter_overhead
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from statistics import median

import numpy as np

from gradient_routes.bench.execution.timing import seconds_of
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.units import duration
from gradient_routes.routes.foreign.manifest import ADAPTERS, START
from gradient_routes.routes.foreign.peer import Peer

NULL = """
from routes_adapter import serve

class Null:
    def gradient(self, p, rtol, adjoint_rtol, options):
        return {"J": 0.0, "gradient": p}

serve(Null(), "null")
"""
SIZES = {100: 1e-3, 10_000: 3e-3, 1_000_000: 50e-3}  # n_p: seconds a call that are to be reached
CALLS = 50


def overhead(peer: Peer, n_p: int) -> tuple[float, float]:
    """Median and least seconds of a call: p is sent, as many numbers come back."""
    p = np.random.default_rng(0).standard_normal(n_p)
    peer.ask("gradient", p=p, rtol=1e-12, adjoint_rtol=1e-12, options={})
    seconds = []
    for _ in range(CALLS):
        took, answer = seconds_of(lambda: peer.ask("gradient", p=p, rtol=1e-12, adjoint_rtol=1e-12, options={}))
        assert (answer["gradient"] == p).all()
        seconds.append(took)
    return median(seconds), min(seconds)


def main() -> None:
    out = console()
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "null.py"
        script.write_text(NULL)
        peer = Peer([sys.executable, "-c", START, str(ADAPTERS / "python"), str(script)], "null")
        for n_p, allowed in SIZES.items():
            middle, least = overhead(peer, n_p)
            out.print(f"n_p = {n_p:,}: {duration(middle)} a call, at best {duration(least)} (<= {duration(allowed)})")
        peer.close()


if __name__ == "__main__":
    main()
