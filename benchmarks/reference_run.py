"""The reference run that is committed: a little of everything a report shows, without the names of the machine.

python -m benchmarks.reference_run
"""

from __future__ import annotations

import shlex
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

STORE = Path("results/reference.sqlite")
COMMANDS = """
run --problem bar --problem 'advection[n=4|8]' --route all
run --problem 'block[n=3]' --route tangent --route adjoint --route implicit-ad --route fd-central
run --problem 'examples/unruly.py:Solver[does=crash]' --route fd-central
vcurve --problem bar --route adjoint --no-plot
vcurve --problem bar --route 'faulty-adjoint[fault=transpose]' --no-plot
check --problem 'advection[n=8]' --route 'faulty-adjoint[fault=transpose]' --no-plot
tolerance --problem 'bar[n=50]' --route adjoint --route implicit-ad --route fd-central --no-plot
unrolling --problem bar --no-plot
kink --problem 'bar[stop=multiplier]' --route adjoint --route fd-central --no-plot
scaling --problem 'bar[n=100|1000|10000|100000]' --route tangent --route adjoint --budget 2 --no-plot
invert --problem bar --route adjoint --route fd-central --no-plot
invert --problem 'bar[n=20,sensors=20,noise=0.005]' --alpha-sweep 1e-5 1 6 --no-plot
invert --problem 'bar[n=20,sensors=20,noise=0.005]' --alpha-sweep 1e-5 1 6 --draws 8 --tolerance 1e-6 --no-plot
invert --problem 'block[n=4,data=twin,noise=0.002,alpha=1e-4]' --no-plot
identify --problem bar --noise 0.01 --sensors 8 --stop multiplier --place 3 --no-plot
identify --problem 'block[n=3,alpha=1e-4]' --noise 1e-3 --no-plot
"""
ENDS = (0, 1, 3)  # a verdict is an answer, and so is a case that crashes on purpose
SCRUB = "UPDATE cases SET host = 'reference', stderr = NULL, traceback = NULL"


def main() -> None:
    STORE.unlink(missing_ok=True)
    routes = str(Path(sys.executable).with_name("routes"))
    for line in COMMANDS.strip().splitlines():
        done = subprocess.run([routes, *shlex.split(line), "--store", str(STORE)], stdout=subprocess.DEVNULL)
        if done.returncode not in ENDS:
            sys.exit(f"reference: routes {line} ended with exit code {done.returncode} - see what it says above")
    with closing(sqlite3.connect(STORE)) as db:
        db.execute(SCRUB)
        db.commit()
        db.execute("VACUUM")


if __name__ == "__main__":
    main()
