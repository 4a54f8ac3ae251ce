"""The literature that statements cite."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Source:
    """A book or an article; `link` is its DOI, or a page of the publisher's."""

    authors: str
    year: int
    title: str
    where: str
    link: str

    @property
    def text(self) -> str:
        """In one line, without the link."""
        return f"{self.authors} ({self.year}). {self.title}. {self.where}."


DOI = "https://doi.org/"
SOURCES = {
    "Ablin et al. 2020": Source(
        "P. Ablin, G. Peyré, T. Moreau",
        2020,
        "Super-efficiency of automatic differentiation for functions defined as a minimum",
        "Proceedings of Machine Learning Research 119 (ICML)",
        "https://arxiv.org/abs/2002.03722",
    ),
    "Blondel et al. 2022": Source(
        "M. Blondel, Q. Berthet, M. Cuturi, R. Frostig, S. Hoyer, F. Llinares-López, F. Pedregosa, J.-P. Vert",
        2022,
        "Efficient and modular implicit differentiation",
        "Advances in Neural Information Processing Systems 35",
        "https://arxiv.org/abs/2105.15183",
    ),
    "Clarke 1990": Source(
        "F. H. Clarke",
        1990,
        "Optimization and nonsmooth analysis",
        "Classics in Applied Mathematics 5, SIAM",
        f"{DOI}10.1137/1.9781611971309",
    ),
    "Colton & Kress 2019": Source(
        "D. Colton, R. Kress",
        2019,
        "Inverse acoustic and electromagnetic scattering theory, 4th edition",
        "Applied Mathematical Sciences 93, Springer",
        f"{DOI}10.1007/978-3-030-30351-8",
    ),
    "Dennis & Schnabel 1996": Source(
        "J. E. Dennis, R. B. Schnabel",
        1996,
        "Numerical methods for unconstrained optimization and nonlinear equations",
        "Classics in Applied Mathematics 16, SIAM; sections 5.4 and 5.6",
        f"{DOI}10.1137/1.9781611971200",
    ),
    "Giles & Pierce 2000": Source(
        "M. B. Giles, N. A. Pierce",
        2000,
        "An introduction to the adjoint approach to design",
        "Flow, Turbulence and Combustion 65, 393-415",
        f"{DOI}10.1023/A:1011430410075",
    ),
    "Gilbert 1992": Source(
        "J. C. Gilbert",
        1992,
        "Automatic differentiation and iterative processes",
        "Optimization Methods and Software 1, 13-21",
        f"{DOI}10.1080/10556789208805503",
    ),
    "Griewank & Walther 2000": Source(
        "A. Griewank, A. Walther",
        2000,
        "Algorithm 799: revolve, an implementation of checkpointing for the reverse or adjoint mode of computational"
        " differentiation",
        "ACM Transactions on Mathematical Software 26, 19-45",
        f"{DOI}10.1145/347837.347846",
    ),
    "Griewank & Walther 2008": Source(
        "A. Griewank, A. Walther",
        2008,
        "Evaluating derivatives: principles and techniques of algorithmic differentiation, 2nd edition",
        "SIAM",
        f"{DOI}10.1137/1.9780898717761",
    ),
    "Gunzburger 2003": Source(
        "M. D. Gunzburger",
        2003,
        "Perspectives in flow control and optimization",
        "Advances in Design and Control 5, SIAM",
        f"{DOI}10.1137/1.9780898718720",
    ),
    "Hansen 2010": Source(
        "P. C. Hansen",
        2010,
        "Discrete inverse problems: insight and algorithms",
        "SIAM",
        f"{DOI}10.1137/1.9780898718836",
    ),
    "Hinze et al. 2009": Source(
        "M. Hinze, R. Pinnau, M. Ulbrich, S. Ulbrich",
        2009,
        "Optimization with PDE constraints",
        "Springer; section 1.6",
        f"{DOI}10.1007/978-1-4020-8839-1",
    ),
    "Kaipio & Somersalo 2005": Source(
        "J. Kaipio, E. Somersalo",
        2005,
        "Statistical and computational inverse problems",
        "Applied Mathematical Sciences 160, Springer",
        f"{DOI}10.1007/b138659",
    ),
    "Martins et al. 2003": Source(
        "J. R. R. A. Martins, P. Sturdza, J. J. Alonso",
        2003,
        "The complex-step derivative approximation",
        "ACM Transactions on Mathematical Software 29, 245-262",
        f"{DOI}10.1145/838250.838251",
    ),
    "Moré & Wild 2011": Source(
        "J. J. Moré, S. M. Wild",
        2011,
        "Estimating computational noise",
        "SIAM Journal on Scientific Computing 33, 1292-1314",
        f"{DOI}10.1137/100786125",
    ),
    "Naumann 2012": Source(
        "U. Naumann",
        2012,
        "The art of differentiating computer programs",
        "Software, Environments, and Tools 24, SIAM",
        f"{DOI}10.1137/1.9781611972078",
    ),
    "Pierce & Giles 2000": Source(
        "N. A. Pierce, M. B. Giles",
        2000,
        "Adjoint recovery of superconvergent functionals from PDE approximations",
        "SIAM Review 42, 247-264",
        f"{DOI}10.1137/S0036144598349423",
    ),
    "Plessix 2006": Source(
        "R.-E. Plessix",
        2006,
        "A review of the adjoint-state method for computing the gradient of a functional with geophysical applications",
        "Geophysical Journal International 167, 495-503",
        f"{DOI}10.1111/j.1365-246X.2006.02978.x",
    ),
    "Squire & Trapp 1998": Source(
        "W. Squire, G. Trapp",
        1998,
        "Using complex variables to estimate derivatives of real functions",
        "SIAM Review 40, 110-112",
        f"{DOI}10.1137/S003614459631241X",
    ),
}
