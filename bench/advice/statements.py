"""What the literature says of every route, and of what decides between them."""

from __future__ import annotations

from dataclasses import dataclass

from gradient_routes.routes.route import Route


@dataclass(frozen=True)
class Statement:
    """A sentence, the keys of its sources in `literature`, and the page of docs/ that says more."""

    text: str
    sources: tuple[str, ...] = ()
    page: str = "explanation/which-route.md"


ADJOINT = ("Giles & Pierce 2000", "Plessix 2006", "Hinze et al. 2009")
OF_ROUTES = {
    "fd-one-sided": Statement(
        "one-sided differences need J only: n_p + 1 solves, and half of the digits of J at the best step",
        ("Dennis & Schnabel 1996",),
        "explanation/step-sizes.md",
    ),
    "fd-central": Statement(
        "central differences need J only: 2 n_p solves, and two thirds of the digits of J at the best step",
        ("Dennis & Schnabel 1996",),
        "explanation/step-sizes.md",
    ),
    "complex-step": Statement(
        "a complex step subtracts nothing, so that its derivative is as accurate as J: n_p complex solves",
        ("Squire & Trapp 1998", "Martins et al. 2003"),
        "explanation/step-sizes.md",
    ),
    "tangent": Statement(
        "the tangent takes one linear solve for each parameter with factors that are at hand, whatever the number of"
        " outputs",
        ("Griewank & Walther 2008", "Hinze et al. 2009"),
        "explanation/adjoint-algebra.md",
    ),
    "adjoint": Statement(
        "the adjoint takes one transposed solve for each output, whatever the number of parameters",
        ADJOINT,
        "explanation/adjoint-algebra.md",
    ),
    "unrolled-ad": Statement(
        "unrolled AD differentiates every iteration; its gradient is that of the iterate, tends to that of the solution"
        " where the iteration converges, and keeps every iteration on a tape",
        ("Gilbert 1992", "Griewank & Walther 2008"),
        "explanation/unconverged-solves.md",
    ),
    "implicit-ad": Statement(
        "implicit AD is the adjoint with R_p^T lam by automatic differentiation: no derivatives by hand, no iterations"
        " on the tape",
        ("Blondel et al. 2022", "Naumann 2012"),
        "explanation/adjoint-algebra.md",
    ),
}
CORRECTED = Statement(
    "a Newton step and an adjoint correction more square the error that loose solves leave, where R is smooth",
    ("Pierce & Giles 2000", "Ablin et al. 2020"),
    "explanation/unconverged-solves.md",
)
CHECKPOINTS = Statement(
    "marching back from few kept states costs steps again and saves memory",
    ("Griewank & Walther 2000",),
    "how-to/march-in-time.md",
)
NOISE = Statement(
    "what solves leave is noise of J, which differences divide by their step",
    ("Moré & Wild 2011", "Dennis & Schnabel 1996"),
    "explanation/step-sizes.md",
)
KINKS = Statement(
    "at a kink there is no gradient: exact routes give that of one branch, a difference across it a mean of the slopes"
    " on both sides",
    ("Clarke 1990", "Griewank & Walther 2008"),
    "explanation/kinks.md",
)
CHECKED = Statement(
    "whichever it is, check it once by another route or by routes check",
    (),
    "how-to/check-your-own-code.md",
)


def of_route(route: Route) -> Statement:
    """What is known of a route; of one that a plug-in registers, its equation."""
    return OF_ROUTES.get(route.name) or Statement(f"{route.name}: {route.summary}", (), "reference/routes.md")
