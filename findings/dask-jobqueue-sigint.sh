#!/usr/bin/env bash
# Software:  dask-jobqueue 0.9.0 with distributed 2026.8.0, Python 3.11
# Behaviour: importing dask_jobqueue replaces the SIGINT handler of the whole process: Ctrl-C raises SystemExit instead
#            of KeyboardInterrupt. Code that imports it and relies on Ctrl-C has to put the handler back.
# Output:    before: KeyboardInterrupt
#            after:  SystemExit
# Used in:   tests/bench/execution/test_cluster.py, which restores the handler after it imports examples/cluster/slurm.py
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
  dask-jobqueue==0.9.0 distributed==2026.8.0 dask==2026.8.0
cd "$folder"
venv/bin/python - <<'PROGRAM'
import os
import signal


def raised():
    try:
        os.kill(os.getpid(), signal.SIGINT)
    except BaseException as error:
        return type(error).__name__


print("before:", before := raised())
import dask_jobqueue

print("after: ", after := raised())
assert (before, after) == ("KeyboardInterrupt", "SystemExit"), "it behaves otherwise now: is the work-around needed?"
PROGRAM
