"""Two buffers that swap roles while a tape records: u' = p - u^2 in 12 explicit steps, J = |u|^2 at the end.

What the library does: a tape of Warp 1.19.0 keeps the arrays of every launch, not their values. Going backward, step k
linearizes at what its input array holds then. With two buffers that is u of a later step. No error is raised.
How it shows: J is right, all components of dJ/dp are off, each by another factor.
The verdict: `PingPong` is a wrong-gradient.
To mend it: an array for every step, as in `FreshArrays`, which agrees.
"""

import numpy as np

dt, n_steps = 0.1, 12


class PingPong:
    start = np.array([1.0, 2.0, 3.0])
    n_buffers = 2

    def value_and_gradient(self, p):
        u = np.zeros((self.n_buffers, len(p)))
        launches = [(k % self.n_buffers, (k + 1) % self.n_buffers) for k in range(n_steps)]  # reads, writes
        for i, o in launches:
            u[o] = u[i] + dt * (p - u[i] ** 2)
        J, g = np.sum(u[o] ** 2), np.zeros_like(p)
        lam = np.zeros_like(u)
        lam[o] = 2.0 * u[o]
        for i, o in reversed(launches):
            written, lam[o] = lam[o].copy(), 0.0
            g += written * dt
            lam[i] += written * (1.0 - 2.0 * dt * u[i])  # u[i] may have been overwritten
        return J, g


class FreshArrays(PingPong):
    n_buffers = n_steps + 1
