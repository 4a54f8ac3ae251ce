"""J read from what a solver prints: a chain of springs in a program that writes `J = 1.23457`.

What the libraries do: C's `%g`, C++ streams and Fortran's list-directed output of single precision print six to nine
digits. A step changes J by less than its last digit, or by a whole one: J is a staircase.
How it shows: the gradient is right, and the best difference quotient of J has two or three digits.
The verdict: `SixDigits` is noise-limited.
To mend it: print 17 digits (`%.17g`, `std::setprecision(17)`), as in `AllDigits`, which agrees.
"""

import numpy as np


def solver(k, digits):
    """The last line that the program prints."""
    return f"J = {0.5 * (np.sum(0.1 / k) - 0.5) ** 2:.{digits}g}"


class SixDigits:
    start = np.linspace(1.0, 2.0, 5)
    digits = 6

    def objective(self, k):
        return float(solver(k, self.digits).removeprefix("J = "))

    def gradient(self, k):
        return -(np.sum(0.1 / k) - 0.5) * 0.1 / k**2


class AllDigits(SixDigits):
    digits = 17
