#!/usr/bin/env bash
# Software:  diffrax 0.7.2, jax 0.10.2 on a CPU, Python 3.11
# Behaviour: with adaptive steps jax.grad holds the steps that were taken, while J itself moves them: at rtol 1e-3 the
#            gradient is 3e-3 off the difference quotient of the same J, on any step from 1e-3 to 1e-6. It is that of J
#            on the held steps, to 1e-9. At rtol 1e-9 the two agree to 1e-8.
# Output:    rtol 0.001: quotient of J off the gradient by 2.7e-03, that on held steps below 1e-7
#            rtol 1e-09: quotient of J off the gradient below 1e-7
# Used in:   docs/how-to/march-in-time.md
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check diffrax==0.7.2 lineax==0.1.1 \
  optimistix==0.1.0 equinox==0.13.8 jax==0.10.2
cd "$folder"
cat >program.py <<'PROGRAM'
import diffrax as dfx
import jax
import jax.numpy as jnp

jax.config.update("jax_enable_x64", True)
P, H = 5.0, 1e-4


def march(p, controller, saved):
    """u'' = -p u - u'/10, u(0) = 1, to t = 10."""
    term = dfx.ODETerm(lambda t, y, p: jnp.array([y[1], -p * y[0] - 0.1 * y[1]]))
    start = jnp.array([1.0, 0.0])
    return dfx.diffeqsolve(
        term, dfx.Tsit5(), 0.0, 10.0, None, start, p, stepsize_controller=controller, saveat=saved, max_steps=2048
    )


def J(p, controller):
    return march(p, controller, dfx.SaveAt(t1=True)).ys[0, 0] ** 2


def quotient(J):
    return (J(P + H) - J(P - H)) / (2 * H)


def off(controller, slope):
    found = jax.jit(lambda p: J(p, controller))
    return abs(float(quotient(found) / slope - 1.0))


for rtol in (1e-3, 1e-9):
    adaptive = dfx.PIDController(rtol=rtol, atol=1e-3 * rtol)
    slope = jax.jit(jax.grad(lambda p: J(p, adaptive)))(P)
    error = off(adaptive, slope)
    if rtol == 1e-3:
        taken = march(P, adaptive, dfx.SaveAt(t0=True, steps=True)).ts
        held = off(dfx.StepTo(taken[jnp.isfinite(taken)]), slope)
        print(f"rtol {rtol:g}: quotient of J off the gradient by {error:.1e}, that on held steps below 1e-7")
        assert error > 1e-3 and held < 1e-7, f"it behaves otherwise now: {error}, {held}"
    else:
        print(f"rtol {rtol:g}: quotient of J off the gradient below 1e-7")
        assert error < 1e-7, f"it behaves otherwise now: {error}"
PROGRAM
venv/bin/python program.py
