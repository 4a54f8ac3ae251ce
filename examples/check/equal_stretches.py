"""The rotation of an element whose two stretches are equal: F = R U, J = R_21, from a singular value decomposition.

What the libraries do: the derivative of F = W diag(s) V^T contains 1 / (s_1^2 - s_2^2), although R = W V^T is smooth.
Where the stretches are equal, JAX 0.10.2 and PyTorch 2.13.0 return NaN. Warp 1.19.0 returns finite numbers that are
wrong: `svd2` 0, as in `Masked`, which leaves out what is not finite, and `svd3` others (0.0625 for 0.5 at F = 1).
How it shows: dJ/dF is wrong at the undeformed element, F = 1, the usual start, and right elsewhere.
The verdict: `InJax` and `Masked` are a wrong-gradient.
To mend it: R without the decomposition, as in `Polar`, which agrees: in two dimensions tan(theta) =
(F_21 - F_12) / (F_11 + F_22).
"""

import jax
import jax.numpy as jnp
import numpy as np

jax.config.update("jax_enable_x64", True)


class Masked:
    start = np.array([1.0, 0.0, 0.0, 1.0])  # F by rows
    scale = 1.0
    names = ("F_11", "F_12", "F_21", "F_22")

    def objective(self, p):
        W, _, Vt = np.linalg.svd(p.reshape(2, 2))
        return (W @ Vt)[1, 0]

    def gradient(self, p):
        W, s, Vt = np.linalg.svd(p.reshape(2, 2))
        gap = s[0] ** 2 - s[1] ** 2
        coupling = 0.0 if gap == 0.0 else (s[0] - s[1]) / gap  # 1 / (s_1 + s_2), as libraries arrive at it
        turned = W.T @ np.array([[0.0, 0.0], [1.0, 0.0]]) @ Vt.T
        return (W @ (coupling * (turned - turned.T)) @ Vt).ravel()


class InJax(Masked):
    def gradient(self, p):
        def J(p):
            W, _, Vt = jnp.linalg.svd(p.reshape(2, 2))
            return (W @ Vt)[1, 0]

        return jax.grad(J)(p)


class Polar(Masked):
    def gradient(self, p):
        a, b = p[0] + p[3], p[2] - p[1]
        return a / (a**2 + b**2) ** 1.5 * np.array([-b, -a, a, -b])
