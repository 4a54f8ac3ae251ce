"""The words of these pages, in alphabetical order: a sentence or two each, exact, with sources and the page to read."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Term:
    """A term, what it means, the page of docs/ that says more, and keys of `literature`."""

    name: str
    meaning: str
    page: str
    sources: tuple[str, ...] = ()


GLOSSARY = (
    Term(
        "active set",
        "The constraints that hold with equality, such as the nodes in contact. Where it changes with p, J has a kink.",
        "explanation/kinks.md",
        ("Clarke 1990",),
    ),
    Term(
        "adjoint state",
        "lam with R_u^T lam = -J_u, the Lagrange multiplier of R = 0 in L = J + lam^T R. The gradient is then"
        " J_p + R_p^T lam.",
        "explanation/adjoint-algebra.md",
        ("Plessix 2006", "Giles & Pierce 2000"),
    ),
    Term(
        "alpha",
        "The weight of the regularization Phi in J = 1/2 |S u - d|^2 + alpha Phi(p).",
        "how-to/invert.md",
        ("Hansen 2010",),
    ),
    Term(
        "blind direction",
        "A change v of p that changes no datum: H v = 0. The gradient of the misfit has no component along it, and the"
        " data do not determine it.",
        "explanation/ill-posed-problems.md",
        ("Hansen 2010",),
    ),
    Term(
        "break-even",
        "The number of parameters at which two routes cost the same.",
        "explanation/costs.md",
    ),
    Term(
        "checkpoint",
        "A state of a march, or an iterate, that is kept so that those after it can be computed again on the way back.",
        "how-to/march-in-time.md",
        ("Griewank & Walther 2000",),
    ),
    Term(
        "complex step",
        "dJ/dp_i = Im J(p + i h e_i) / h, to O(h^2). Nothing is subtracted, so that h can be 1e-30.",
        "explanation/step-sizes.md",
        ("Squire & Trapp 1998", "Martins et al. 2003"),
    ),
    Term(
        "discrepancy principle",
        "alpha is right where the misfit is as large as the noise of the data.",
        "how-to/invert.md",
        ("Hansen 2010",),
    ),
    Term(
        "discretize first",
        "To differentiate the discretized equations, which gives the exact gradient of the J that is computed. An"
        " adjoint equation that is derived first and discretized then agrees only as the mesh size goes to 0.",
        "explanation/adjoint-algebra.md",
        ("Gunzburger 2003", "Giles & Pierce 2000"),
    ),
    Term(
        "forward solve",
        "u with R(u, p) = 0 at one p. The unit of costs.",
        "explanation/costs.md",
    ),
    Term(
        "gradient",
        "dJ/dp, (n_p,): the derivative of J(u(p), p), u following p.",
        "explanation/adjoint-algebra.md",
        ("Hinze et al. 2009",),
    ),
    Term(
        "implicit differentiation",
        "The derivative of u(p) by R_u du/dp = -R_p at the solution, whatever iteration has found it.",
        "explanation/adjoint-algebra.md",
        ("Blondel et al. 2022",),
    ),
    Term(
        "inverse crime",
        "To invert synthetic data with the very model that made them. The result is better than any that measured data"
        " will give.",
        "how-to/use-your-mesh-and-data.md",
        ("Colton & Kress 2019", "Kaipio & Somersalo 2005"),
    ),
    Term(
        "iterate",
        "The u_k after k iterations of a solver. Its derivative is not that of the solution before the iteration has"
        " converged.",
        "explanation/unconverged-solves.md",
        ("Gilbert 1992",),
    ),
    Term(
        "kink",
        "A p at which the derivatives of J from the left and from the right differ. There is no gradient there.",
        "explanation/kinks.md",
        ("Clarke 1990", "Griewank & Walther 2008"),
    ),
    Term(
        "L-curve",
        "Phi against the misfit for many alpha, both logarithmic. Its corner balances the noise that is fitted against"
        " the data that are not.",
        "how-to/invert.md",
        ("Hansen 2010",),
    ),
    Term(
        "noise floor",
        "The least error of a difference quotient over all steps, where its error by truncation is about that by the"
        " noise of J. About eps^(1/2) one-sided and eps^(2/3) central, eps being the noise relative to J.",
        "explanation/step-sizes.md",
        ("Dennis & Schnabel 1996", "Moré & Wild 2011"),
    ),
    Term(
        "plateau",
        "A V-curve that stops falling at the size of a mistake: the gradient is wrong, whatever the step.",
        "explanation/step-sizes.md",
    ),
    Term(
        "regularization",
        "A term alpha Phi(p) of J that says what p is likely to be where data do not. It trades variance for bias.",
        "explanation/ill-posed-problems.md",
        ("Hansen 2010",),
    ),
    Term(
        "residual",
        "R(u, p), (n_u,), zero at the solution. |R| / |R(u_0, p)| says how well a state is solved for.",
        "explanation/unconverged-solves.md",
    ),
    Term(
        "reverse mode",
        "Automatic differentiation from J back to p: the gradient of one output at a few times the cost of J, whatever"
        " n_p is. It needs the intermediate values in reverse order.",
        "explanation/costs.md",
        ("Griewank & Walther 2008", "Naumann 2012"),
    ),
    Term(
        "revolve",
        "Checkpointing that keeps s states and marches as few steps again as is possible with these.",
        "how-to/march-in-time.md",
        ("Griewank & Walther 2000",),
    ),
    Term(
        "rounding floor",
        "The noise floor where solves are exact and J is noisy by rounding only: eps = 2.2e-16, so that one-sided"
        " quotients reach 1.5e-8 and central ones 4e-11.",
        "explanation/step-sizes.md",
        ("Dennis & Schnabel 1996",),
    ),
    Term(
        "sensitivity matrix",
        "H = d(S u)/dp, (m, n_p): what a change of every parameter does to every datum. Its singular values say what"
        " the data determine.",
        "how-to/identify.md",
        ("Hansen 2010",),
    ),
    Term(
        "tangent",
        "du/dp_i by R_u du_i = -R_p e_i: one linear solve for each parameter, for all outputs. Also called the direct"
        " method, or forward sensitivities.",
        "explanation/adjoint-algebra.md",
        ("Griewank & Walther 2008", "Hinze et al. 2009"),
    ),
    Term(
        "tape",
        "What automatic differentiation keeps between its forward and its backward sweep.",
        "explanation/costs.md",
        ("Griewank & Walther 2008",),
    ),
    Term(
        "Taylor test",
        "J(p + h v) - J(p) - h g.v falls as h^2 for the right gradient g, as h for one that is wrong along v.",
        "explanation/what-a-verdict-rests-on.md",
    ),
    Term(
        "unrolling",
        "To differentiate through every iteration of a solver, all of them on the tape.",
        "explanation/unconverged-solves.md",
        ("Gilbert 1992", "Griewank & Walther 2008"),
    ),
    Term(
        "V-curve",
        "The error of a difference quotient against its step, both logarithmic. Truncation falls with the step, noise"
        " rises as 1/h; between them is the floor.",
        "explanation/step-sizes.md",
        ("Dennis & Schnabel 1996",),
    ),
)
