"""A front that grows and spreads (Fisher 1937): u' = D u_xx + r u (1 - u) on 0 < x < 1, implicit steps of h.

D, r and the height of the front at first are sought from one sensor: a transient problem of one's own, on all routes.
"""

import numpy as np
from scipy import sparse

from gradient_routes import Linearization, Offers, Parameters, Transient


class Front(Transient):
    name = "front"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    parameters = Parameters(
        start=np.array([0.01, 3.0, 0.5]),
        scale=np.array([0.01, 3.0, 0.5]),
        lower=0.0,
        label=["D", "r", "height"].__getitem__,
    )

    def __init__(self, *, n: int = 30, steps: int = 20):
        self.steps, self.n_state, self.h = steps, n * steps, 0.05
        x = (np.arange(n) + 0.5) / n
        self.bump = np.exp(-(((x - 0.3) / 0.1) ** 2))
        K = sparse.diags_array([-np.ones(n - 1), np.full(n, 2.0), -np.ones(n - 1)], offsets=[-1, 0, 1]).tolil()
        K[0, 0] = K[-1, -1] = 1.0
        self.K, self.I = K.tocsr() * n**2, sparse.eye_array(n).tocsr()
        self.sensor, self.d = n // 2, np.linspace(0.0, 1.0, steps) ** 2

    def initial_state(self, p, xp=np):
        return p[2] * xp.asarray(self.bump)

    def initial_by(self, p):
        return np.outer(self.bump, [0.0, 0.0, 1.0])

    def step_residual(self, t, u, v, p, xp=np):
        Ku = self.K @ u if xp is np else xp.asarray(self.K.toarray()) @ u
        return u - v + self.h * (p[0] * Ku - p[1] * u * (1.0 - u))

    def step_tangent(self, t, u, v, p):
        return self.I + self.h * (p[0] * self.K - sparse.diags_array(p[1] * (1.0 - 2.0 * u)))

    def step_coupling(self, t, u, v, p):
        return -self.I

    def step_objective(self, t, u, p, xp=np):
        return 0.5 * (u[self.sensor] - xp.asarray(self.d)[t - 1]) ** 2

    def step_linearize(self, t, u, v, p):
        J_u = np.zeros_like(u)
        J_u[self.sensor] = u[self.sensor] - self.d[t - 1]
        R_p = self.h * np.stack([self.K @ u, -u * (1.0 - u), np.zeros_like(u)], axis=1)
        return Linearization(R_p, J_u, np.zeros_like(p))
