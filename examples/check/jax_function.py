"""A JAX function and its gradient by jax.grad: the energy of a chain of pendulums."""

import jax
import jax.numpy as jnp

jax.config.update("jax_enable_x64", True)  # else JAX computes in float32, and the check says so


def energy(theta):
    return jnp.sum(1.0 - jnp.cos(theta)) + 0.5 * jnp.sum(jnp.diff(theta) ** 2)


class Pendulums:
    start = jnp.linspace(-1.0, 1.0, 50)
    value_and_gradient = staticmethod(jax.jit(jax.value_and_grad(energy)))
