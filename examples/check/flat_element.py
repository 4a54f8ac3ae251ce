"""The determinant of an element that is flat: J = (det F - 1)^2 / 2 at a deformation gradient F of rank 2.

What the library does: the derivative of det F is the cofactor of F. PyTorch 2.13.0 computes it as det F times F^-T,
with a small number in place of a pivot that is zero. At a singular F that is 0. The cofactor of a flat element is not.
How it shows: dJ/dF = 0 at a flat element, so an optimizer leaves it flat. A hair away from it dJ/dF is right.
The verdict: `DeterminantTimesInverse` is a wrong-gradient.
To mend it: cofactors by cross products of the rows of F, as in `Cofactors`, which agrees. `jnp.linalg.det` of JAX
0.10.2 and the determinants of Warp 1.19.0 and Taichi 1.7.4 are right there.
"""

import numpy as np


class DeterminantTimesInverse:
    start = np.array([1.2, 0.3, 0.1, -0.2, 0.9, 0.4, 0.0, 0.0, 0.0])  # F by rows; the third is squeezed to nothing
    scale = 1.0
    names = tuple(f"F_{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3))

    def objective(self, p):
        return 0.5 * (np.linalg.det(p.reshape(3, 3)) - 1.0) ** 2

    def gradient(self, p):
        F = p.reshape(3, 3)
        return ((np.linalg.det(F) - 1.0) * self.cofactor(F)).ravel()

    def cofactor(self, F):
        return np.linalg.det(F) * np.linalg.pinv(F).T


class Cofactors(DeterminantTimesInverse):
    def cofactor(self, F):
        a, b, c = F
        return np.array([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
