"""The only module that imports JAX: in float64, on the CPU unless JAX_PLATFORMS says otherwise, synchronously."""

from __future__ import annotations

import os

os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax
import jax.numpy as jnp

jax.config.update("jax_enable_x64", True)  # type: ignore[no-untyped-call]  # JAX gives update no types
# asynchronous dispatch makes a kernel of 30 us take 45 to 80 us
jax.config.update("jax_cpu_enable_async_dispatch", False)  # type: ignore[no-untyped-call]

__all__ = ["jax", "jnp"]
