"""An index past the end of an array: conductivities k of 6 cells, J the resistance of the faces to their right.

What the library does: in JAX 0.10.2, k[i] with i one past the end is the last entry, without an error. The backward
sweep adds to the entry i, and additions past the end are dropped. So the value is clamped and its derivative is lost.
How it shows: all components are right but the last.
The verdict: `PastEnd` is a wrong-gradient, and the component is named.
To mend it: clip the index, as in `Clipped`, which agrees, or write k.at[i].get(mode="clip"). With
k.at[i].get(mode="fill", fill_value=jnp.nan) a wrong index shows as NaN in J.
"""

import jax
import jax.numpy as jnp

jax.config.update("jax_enable_x64", True)

n = 6


def resistance(k, right):
    """Sum of 1 / k over the faces; k of a face is the mean of the cells on both sides."""
    return jnp.sum(2.0 / (k + k[right]))


differentiated = jax.jit(jax.value_and_grad(resistance))


class PastEnd:
    start = jnp.linspace(1.0, 2.0, n)
    names = tuple(f"k_{i + 1}" for i in range(n))
    bounds = (1e-3, jnp.inf)
    right = jnp.arange(n) + 1

    def value_and_gradient(self, k):
        return differentiated(k, self.right)


class Clipped(PastEnd):
    right = jnp.minimum(jnp.arange(n) + 1, n - 1)
