"""The one place where JAX is imported: before any array is made, in float64, on the CPU unless told otherwise.

On the CPU it runs in the thread that calls.
"""

from __future__ import annotations

import os

os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax
import jax.numpy as jnp

jax.config.update("jax_enable_x64", True)  # type: ignore[no-untyped-call]  # JAX gives update no types
# a kernel of 30 us run by another thread takes 45 or 80 us, as it comes
jax.config.update("jax_cpu_enable_async_dispatch", False)  # type: ignore[no-untyped-call]

__all__ = ["jax", "jnp"]
