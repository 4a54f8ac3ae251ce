#!/usr/bin/env bash
# Software:  NLopt 2.11.0, Ipopt 3.14.19 in CasADi 3.8.2 (limited-memory Hessian) with NumPy 2.4.6, Python 3.11
# Behaviour: given a gradient of the wrong sign, NLopt's MMA, CCSAQ and SLSQP return a positive code (XTOL_REACHED or
#            FTOL_REACHED, success) at the start; LBFGS raises. With an offset, all but LBFGS return success where the
#            true gradient is not 0. Ipopt runs away at a wrong sign and says so. All of them report success at the
#            start for a gradient of zero. J is Rosenbrock's valley, 24.2 at its start (-1.2, 1), 0 at its minimum; 1 %:
#            one component 1 % too large, the other too small; offset: 1.6 on both, where |g| is 233 at the start.
# Output:            1 %                offset            sign              zero
#            LBFGS   success, minimum   failure, start    failure, start    success, start
#            MMA     failure, minimum   success, between  success, start    success, start
#            CCSAQ   failure, minimum   success, between  success, start    success, start
#            SLSQP   success, minimum   success, between  success, start    success, start
#            Ipopt   success, minimum   failure, between  failure, away     success, start
#            (MMA and CCSAQ stop after 3000 evaluations near the minimum, with the right gradient, too)
# Used in:   docs/explanation/optimizers.md
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check nlopt==2.11.0 casadi==3.8.2 numpy==2.4.6
cd "$folder"
venv/bin/python - <<'PROGRAM'
import casadi
import nlopt
import numpy as np

start = np.array([-1.2, 1.0])


def J(x):
    return float(100.0 * (x[1] - x[0] ** 2) ** 2 + (1.0 - x[0]) ** 2)


def dJ(x):
    r = x[1] - x[0] ** 2
    return np.array([-400.0 * r * x[0] - 2.0 * (1.0 - x[0]), 200.0 * r])


offset = 0.01 * np.linalg.norm(dJ(start)) / np.sqrt(2.0)
FAULTS = {
    "1 %": lambda g: g * np.array([1.01, 0.99]),
    "offset": lambda g: g + offset,
    "sign": lambda g: -g,
    "zero": lambda g: 0.0 * g,
}


def place(J):
    return "minimum" if J < 1e-4 else "between" if J < 24.1 else "start" if J < 25.0 else "away"


def by_nlopt(name, fault):
    def called(x, gradient):
        if gradient.size:
            gradient[:] = fault(dJ(x))
        return J(x)

    optimizer = nlopt.opt(getattr(nlopt, f"LD_{name}"), 2)
    optimizer.set_min_objective(called)
    optimizer.set_xtol_rel(1e-8)
    optimizer.set_ftol_rel(1e-12)
    optimizer.set_maxeval(3000)
    try:
        x = optimizer.optimize(start)
    except nlopt.runtime_error:  # no x is returned
        return "failure, start"
    success = 0 < optimizer.last_optimize_result() < nlopt.MAXEVAL_REACHED
    return f"{'success' if success else 'failure'}, {place(J(x))}"


class Gradient(casadi.Callback):
    def __init__(self, name, options, fault):
        casadi.Callback.__init__(self)
        self.fault = fault
        self.construct(name, options)

    def get_n_in(self):
        return 2

    def get_sparsity_in(self, i):
        return casadi.Sparsity.dense(2 - i, 1)

    def get_sparsity_out(self, i):
        return casadi.Sparsity.dense(1, 2)

    def eval(self, given):
        return [casadi.DM(self.fault(dJ(np.array(given[0]).ravel()))).T]


class Objective(casadi.Callback):
    def __init__(self, fault):
        casadi.Callback.__init__(self)
        self.fault = fault
        self.construct("J", {"enable_fd": False})

    def get_sparsity_in(self, i):
        return casadi.Sparsity.dense(2, 1)

    def eval(self, given):
        return [J(np.array(given[0]).ravel())]

    def has_jacobian(self):
        return True

    def get_jacobian(self, name, inputs, outputs, options):
        self.gradient = Gradient(name, options, self.fault)
        return self.gradient


def by_ipopt(fault):
    objective, x = Objective(fault), casadi.MX.sym("x", 2)
    options = {"hessian_approximation": "limited-memory", "print_level": 0, "sb": "yes", "max_iter": 300}
    solver = casadi.nlpsol("S", "ipopt", {"x": x, "f": objective(x)}, {"ipopt": options, "print_time": False})
    found = np.array(solver(x0=start)["x"]).ravel()
    return f"{'success' if solver.stats()['success'] else 'failure'}, {place(J(found))}"


found = {name: [by_nlopt(name, fault) for fault in FAULTS.values()] for name in ("LBFGS", "MMA", "CCSAQ", "SLSQP")}
found["Ipopt"] = [by_ipopt(fault) for fault in FAULTS.values()]
for name, says in found.items():
    print(f"{name:8}" + "".join(f"{one:18}" for one in says))
sound, stopped, start_ = "success, minimum", "failure, minimum", "success, start"
assert found == {
    "LBFGS": [sound, "failure, start", "failure, start", start_],
    "MMA": [stopped, "success, between", start_, start_],
    "CCSAQ": [stopped, "success, between", start_, start_],
    "SLSQP": [sound, "success, between", start_, start_],
    "Ipopt": [sound, "failure, between", "failure, away", start_],
}, "they behave otherwise now: correct the table of docs/explanation/optimizers.md"
PROGRAM
