"""A loop that is one trip too long to be unrolled: u <- p_1 u + p_2, J = u^2 after all trips.

What the library does: Warp 1.19.0 unrolls loops of up to 16 trips (`max_unroll`). In a longer loop a variable has one
place for all trips. The backward kernel does not run the loop forward first: it linearizes J at the u of the start, and
then repeats the trips forward while the adjoint goes backward. No error is raised.
How it shows: 16 trips are right, 17 are wrong in all components; a sum such as u <- u + p_i^2 stays right.
The verdict: `Trips16` agrees, `Trips17` is a wrong-gradient.
To mend it: `wp.set_module_options({"max_unroll": 17})`, or an array with an entry for the u of every trip. Either keeps
all of them, as `Trips17Unrolled` does, which agrees.
"""

import numpy as np

u_0 = 0.5


class Trips16:
    start = np.array([0.9, 0.2])
    trips, max_unroll = 16, 16

    def states(self, p):
        u = [u_0]
        for _ in range(self.trips):
            u.append(p[0] * u[-1] + p[1])
        return u

    def objective(self, p):
        return self.states(p)[-1] ** 2

    def gradient(self, p):
        u = self.states(p)
        unrolled = self.trips <= self.max_unroll
        last, linearized_at = (u[-1], u[-2::-1]) if unrolled else (u[0], u[1:])
        lam, g = 2.0 * last, np.zeros(2)
        for v in linearized_at:
            g += lam * np.array([v, 1.0])
            lam *= p[0]
        return g


class Trips17(Trips16):
    trips = 17


class Trips17Unrolled(Trips17):
    max_unroll = 17
