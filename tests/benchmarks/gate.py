"""Kernels and routes against tests/benchmarks/baseline.json: `make benchmark-regression`.

    python tests/benchmarks/gate.py            all rounds
    python tests/benchmarks/gate.py --short    fewer, for CI
    python tests/benchmarks/gate.py --write    three sessions, whose medians become the baseline

What seems slower is measured twice more before it is called so. Exit code: 0 nothing is worse, 1 a regression, 2 the
benchmarks themselves failed.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from kernels import REMEDY, Kernels, again, judge, of_session, read, typical, write

from gradient_routes.bench.regression.finding import JUDGEMENTS, Finding
from gradient_routes.problems.errors import InputError

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
BASELINE = HERE / "baseline.json"
MEASURED = ("bench_routes.py", "bench_kernels.py")
SECONDS = {"short": 0.1, "full": 0.5, "confirm": 1.0}  # of CPU time for the rounds of one benchmark
SESSIONS = 3  # behind a baseline
ALIKE = {
    # the number of a machine's cores is none of a route's business
    **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    # nor is which pages a process happens to give back and to fetch again
    **dict.fromkeys(("MALLOC_MMAP_THRESHOLD_", "MALLOC_TRIM_THRESHOLD_"), str(2**25)),
    "PYTHONHASHSEED": "0",
}


CONFIRMED = 2  # times that what seems slower is measured again: a busy minute is no regression


def session(form: str, only: Sequence[str] = ()) -> Kernels:
    """Measure all benchmarks, or those of the node ids `only`, in a process of their own. Raises InputError."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "session.json"
        command = [sys.executable, "-m", "pytest", *(only or (str(HERE / name) for name in MEASURED))]
        command += ["-p", "no:xdist", "--benchmark-only", "--benchmark-disable-gc", "--benchmark-quiet"]
        # time of the process, not of the wall: neighbours on a shared machine make it wait, not work
        command += ["--benchmark-timer=time.process_time", f"--benchmark-json={report}"]
        # a round of short calls is as long as the clock's own cost is nothing beside it
        command += ["--benchmark-min-time=0.0002", "--benchmark-min-rounds=5", f"--benchmark-max-time={SECONDS[form]}"]
        done = subprocess.run(command, cwd=ROOT, env={**os.environ, **ALIKE}, capture_output=True, text=True)
        if done.returncode:
            print(done.stdout[-4000:], done.stderr[-4000:], file=sys.stderr)
            raise InputError(f"benchmarks: pytest ended with {done.returncode} - mend what it says above")
        return of_session(report)


def worse(findings: Sequence[Finding], metric: str | None = None) -> list[str]:
    names = (f.case["name"] for f in findings if f.judgement == "worse" and metric in (None, f.metric))
    return list(dict.fromkeys(names))


def measure_and_judge(form: str) -> list[Finding]:
    """All benchmarks judged, the slow ones confirmed."""
    base, new = read(BASELINE), session(form)
    for _ in range(CONFIRMED):
        suspects = worse(judge(base, new), "time")
        if not suspects:
            break
        print(f"measured again, for they seemed slower: {', '.join(short(name) for name in suspects)}")
        new = again(new, session("confirm", suspects))
    return judge(base, new)


def short(name: str) -> str:
    return name.rpartition("::")[2].removeprefix("test_")


def report(findings: Sequence[Finding]) -> int:
    """What changed, the slowest and fastest of what did not; the exit code. Raises InputError where none was timed."""
    growths = sorted((f.new / f.base, short(f.case["name"])) for f in findings if f.metric == "time")
    if not growths:
        gone = len(worse(findings))
        raise InputError(f"of {gone} benchmarks in {BASELINE.name} none was measured - {REMEDY}, or mend their names")
    for finding in sorted(findings, key=lambda f: JUDGEMENTS.index(f.judgement)):
        if finding.judgement != "same":
            print(f"{finding.judgement}: {short(finding.case['name'])}: {finding.metric}: {finding.says}")
    extremes = f"from x {growths[0][0]:.2f} ({growths[0][1]}) to x {growths[-1][0]:.2f} ({growths[-1][1]})"
    failed = worse(findings)
    print(f"{'a regression' if failed else 'no regression'}: {len(growths)} benchmarks, {extremes}")
    return 1 if failed else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--short", action="store_true", help="fewer rounds, for CI")
    parser.add_argument("--write", action="store_true", help="write the baseline anew")
    asked = parser.parse_args()
    try:
        if asked.write:
            write(BASELINE, typical([session("full") for _ in range(SESSIONS)]))
            print(f"{len(read(BASELINE))} benchmarks in {BASELINE.relative_to(ROOT)}")
            return 0
        return report(measure_and_judge("short" if asked.short else "full"))
    except InputError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
