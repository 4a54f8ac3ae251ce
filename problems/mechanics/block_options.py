"""Options of a block: which there can be, and which go together."""

from __future__ import annotations

import math
from types import SimpleNamespace

from gradient_routes.problems.data.regularization import WIDTH
from gradient_routes.problems.errors import InputError, check_applies
from gradient_routes.problems.mechanics.design_variables import FIELDS, MATERIAL

CASES = 3  # along z, x, y
MOST = 10**7  # cells, markers, layers: more fit in no memory


def check(o: SimpleNamespace) -> None:
    """Raises InputError for options by their names that are out of range, or that would be ignored."""
    _check_counts(o)
    _check_applies(o)
    _check_numbers(o)
    _check_unknown(o)


def lengths(size: str) -> tuple[float, float, float]:
    """Lx, Ly, Lz [m] of `size`. Raises InputError."""
    try:
        L = [float(part) for part in str(size).split(",")]
    except ValueError:
        L = []
    if len(L) == 1:
        L *= 3
    if len(L) != 3 or not all(1e-9 <= L_i <= 1e9 for L_i in L):
        raise InputError(f"block: size={size} - give one length or three, such as 1,2,0.5, from 1e-9 to 1e9 m")
    return L[0], L[1], L[2]


def _check_counts(o: SimpleNamespace) -> None:
    least = {"n": 1, "nx": 1, "ny": 1, "nz": 1, "layers": 1, "cases": 1, "markers": 0, "seed": 0}
    for name, value in least.items():
        count = getattr(o, name)
        if count is not None and count < value:
            raise InputError(f"block: {name}={count} - choose {name} >= {value}")
    if o.cases > CASES:
        raise InputError(f"block: cases={o.cases} - there are 1 to {CASES}: along z, x, y")
    greatest = max((o.nx or o.n) * (o.ny or o.n) * (o.nz or o.n), o.markers, o.layers or 0)
    if greatest > MOST:
        raise InputError(f"block: {greatest:g} cells, markers or layers - at most {MOST:g}")


def _check_applies(o: SimpleNamespace) -> None:
    meshed, measured, gripped = o.mesh is not None, o.data not in (None, "twin"), o.load == "displacement"
    check_applies(
        "block",
        ("mesh", meshed, False, {"n": o.n != 4, "nx": o.nx, "ny": o.ny, "nz": o.nz, "size": o.size != "1"}),
        ("mesh", meshed, False, {"element": o.element != "hex8"}),
        ("markers", o.markers > 0, True, {"face": o.face != "right", "components": o.components != "all"}),
        ("markers", o.markers > 0, False, {"sensors": o.sensors}),
        ("data=FILE", measured, False, {"sensors": o.sensors, "markers": o.markers, "cases": o.cases > 1}),
        ("unknown=layers", o.unknown == "layers", True, {"layers": o.layers}),
        ("unknown=shape", o.unknown == "shape", True, {"surface": o.surface != "right"}),
        ("load=displacement", gripped, True, {"displacement": o.displacement != 0.2}),
        ("load=displacement", gripped, False, {"traction": o.traction != 0.2}),
        ("phi=tv", o.phi == "tv", True, {"phi_width": o.phi_width != WIDTH}),
        ("unknown=modulus or layers", o.unknown in FIELDS, True, {"phi": o.phi in ("tikhonov", "tv")}),
        ("unknown=modulus or layers", o.unknown in FIELDS, True, {"parametrization": o.parametrization}),
    )


def _check_numbers(o: SimpleNamespace) -> None:
    if not -1.0 < o.nu < 0.5 - 1e-9:
        raise InputError(f"block: nu={o.nu:g} - the laws are compressible, choose -1 < nu < 0.5")
    if not (math.isfinite(o.traction) and math.isfinite(o.displacement)):
        raise InputError(f"block: traction={o.traction:g}, displacement={o.displacement:g} - choose finite ones")
    if not 0 <= o.noise < math.inf or (o.noise and o.data != "twin"):
        raise InputError(f"block: noise={o.noise:g} - choose noise >= 0, for synthetic data (data=twin) only")


def _check_unknown(o: SimpleNamespace) -> None:
    if o.unknown == "traction" and (o.load != "traction" or o.cases > 1):
        raise InputError(
            f"block: unknown=traction with load={o.load}, cases={o.cases} - it takes one case of load=traction"
        )
    if o.derivatives == "hand" and o.unknown not in MATERIAL:
        raise InputError(f"block: derivatives=hand are by material constants, not by {o.unknown} - take derivatives=ad")
