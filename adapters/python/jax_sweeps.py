"""Reverse mode by JAX in its two sweeps, for adapters: seconds of each and of compilation, bytes held between them."""

from time import perf_counter

import jax

_compiling = []
jax.monitoring.register_event_duration_secs_listener(
    lambda event, seconds, **_: _compiling.append(seconds) if event.startswith("/jax/core/compile/") else None
)


def value_and_gradient(J, p):
    """J(p) and dJ/dp (n_p,), as the result of `gradient`."""
    before, start = len(_compiling), perf_counter()
    value, pull = jax.vjp(J, p)
    value = float(value)
    tape_bytes, solved = sum(each.nbytes for each in jax.tree.leaves(pull)), perf_counter()
    gradient = jax.device_get(pull(1.0)[0])
    return {
        "J": value,
        "gradient": gradient,
        "forward_s": solved - start,
        "backward_s": perf_counter() - solved,
        "compile_s": sum(_compiling[before:]),
        "tape_bytes": tape_bytes,
    }
