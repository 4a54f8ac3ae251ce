#!/usr/bin/env bash
# Software:  warp-lang 1.19.0 on a CPU, Python 3.11
# Behaviour: tape.zero() clears the gradients that this tape has made. One that an earlier tape has left in an array is
#            not cleared by the zero() of a new tape over the same array: the next backward() adds to it. Newton's
#            method with a tape at every iterate thus has a wrong first product with R_u at each.
# Output:    first tape: 2
#            second tape, zero() before: 5
#            second tape, zero() once more: 3
# Used in:   adapters/warp.py, whose arrays are new at every iterate
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check warp-lang==1.19.0 numpy
cd "$folder"
cat >program.py <<'PROGRAM'
import warp as wp

wp.config.quiet = True
one = wp.array([1.0], dtype=float, device="cpu")


@wp.kernel
def times(x: wp.array(dtype=float), factor: float, y: wp.array(dtype=float)):
    y[0] = factor * x[0]


def recorded(factor, y):
    with wp.Tape() as tape:
        wp.launch(times, 1, [x, factor], [y], device="cpu")
    return tape


def slope(tape, y):
    tape.zero()
    tape.backward(grads={y: one})
    return float(x.grad.numpy()[0])


x = wp.array([1.0], dtype=float, device="cpu", requires_grad=True)
y = wp.zeros(1, dtype=float, device="cpu", requires_grad=True)
first = slope(recorded(2.0, y), y)
second = recorded(3.0, y)
found = [first, slope(second, y), slope(second, y)]
for name, value in zip(("first tape", "second tape, zero() before", "second tape, zero() once more"), found):
    print(f"{name}: {value:g}")
assert found == [2.0, 5.0, 3.0], "it behaves otherwise now: may the adapter keep its arrays?"
PROGRAM
venv/bin/python program.py
