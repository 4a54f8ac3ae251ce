"""The one place where JAX is imported: in float64 and on the CPU unless told otherwise, before any array is made."""

from __future__ import annotations

import os

os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax
import jax.numpy as jnp

jax.config.update("jax_enable_x64", True)  # type: ignore[no-untyped-call]  # JAX gives update no types

__all__ = ["jax", "jnp"]
