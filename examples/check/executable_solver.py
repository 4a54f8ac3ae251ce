"""The external program of executable.py: k x + c x^3 = 1 by damped iterations, J = (x - 1)^2 / 2, p = (k, c)."""

k, c, tolerance = map(float, input().split())
x = 0.0
while abs(k * x + c * x**3 - 1.0) > max(tolerance, 1e-15):
    x -= 0.5 * (k * x + c * x**3 - 1.0) / (k + 3.0 * c * x**2)
lam = -(x - 1.0) / (k + 3.0 * c * x**2)
print(0.5 * (x - 1.0) ** 2, lam * x, lam * x**3)
