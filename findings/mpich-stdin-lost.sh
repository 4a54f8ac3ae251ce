#!/usr/bin/env bash
# Software:  mpich 5.0.2, the wheel of PyPI, whose mpiexec is Hydra, Python 3.12
# Behaviour: mpiexec passes stdin to rank 0 without flow control. Where more than a pipe holds, 64 KiB, comes before
#            the rank has read it, the proxy ends with "process reading stdin too slowly; can't keep up" and the run
#            with it: whether a program lives depends on the load of the machine.
# Output:    60000 bytes: 60000 read
#            1000000 bytes: mpiexec fails, none read
# Used in:   routes/foreign/manifest.py, which lets rank 0 open the descriptors of mpiexec itself
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check mpich==5.0.2
cd "$folder"
cat >program.py <<'PROGRAM'
import subprocess
import sys

READ = "import sys, time; time.sleep(2); print(len(sys.stdin.buffer.read()))"


def passed(n):
    """Exit code and output of one rank that is sent n bytes while it is busy."""
    command = ["venv/bin/mpiexec", "-n", "1", sys.executable, "-c", READ]
    done = subprocess.run(command, input=bytes(n), capture_output=True)
    failed = "mpiexec fails, " if done.returncode else ""
    print(f"{n} bytes: {failed}{done.stdout.decode().strip() or 'none'} read")
    return done.returncode, done.stdout.split()


assert passed(60_000) == (0, [b"60000"])
code, read = passed(1_000_000)
assert code != 0 and not read, "it waits now: may stdin be read through mpiexec?"
PROGRAM
venv/bin/python program.py
