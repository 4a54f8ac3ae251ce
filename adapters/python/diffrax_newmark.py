"""Newmark's steps of the vibrating bar as a solver of Diffrax, which has none that takes them."""

import diffrax as dfx
import jax
import jax.numpy as jnp


class Newmark(dfx.AbstractSolver):
    """Of y = (u, v, J): (M + h^2/4 K) dv = h (f - K (u + h/2 v)), f the mean of the step."""

    term_structure = dfx.ODETerm
    interpolation_cls = dfx.LocalLinearInterpolation

    def order(self, terms):
        return 2

    def init(self, terms, t0, t1, y0, args):
        return None

    def func(self, terms, t0, y0, args):
        return terms.vf(t0, y0, args)

    def step(self, terms, t0, t1, y0, args, solver_state, made_jump):
        (u, v, J), (k, M, h, F, sensors, data) = y0, args
        t = jnp.round(t0 / h).astype(int)
        above = jnp.append(k[1:], 0.0)

        def stiff(x):
            q = k * jnp.diff(x, prepend=0.0)
            return q - jnp.append(q[1:], 0.0)

        b = (-h * stiff(u + h / 2 * v)).at[-1].add(h / 2 * (F[t] + F[t + 1]))
        diagonal, off = M + h**2 / 4 * (k + above), -(h**2) / 4 * above
        dv = jax.lax.linalg.tridiagonal_solve(jnp.roll(off, 1), diagonal, off, b[:, None])[:, 0]
        u, v = u + h * v + h / 2 * dv, v + dv
        y = u, v, J + 0.5 * jnp.sum((u[sensors - 1] - data[t]) ** 2)
        return y, None, {"y0": y0, "y1": y}, None, dfx.RESULTS.successful
