"""Options that all problems of solids have, and their validation."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Annotated, Literal

from gradient_routes.problems.data.motion import MotionName
from gradient_routes.problems.data.placing import Outside
from gradient_routes.problems.data.regularization import PHI_WIDTH
from gradient_routes.problems.data.units import standard_deviation
from gradient_routes.problems.errors import InputError, check_applies
from gradient_routes.problems.mechanics.design_variables import FIELDS, MATERIAL, MODULI
from gradient_routes.problems.mechanics.loaded_solid import Load

MAX_COUNT = 10**7  # of cells, markers, layers
LENGTHS = 1e-9, 1e9  # [m]

LawName = Literal["neo-hookean", "mooney-rivlin", "yeoh", "ogden", "linear", "arap"]
Kind = Literal["plane-stress", "plane-strain", "axisymmetric"]
Count = Annotated[int, "cells along every edge"]
Along = Annotated[int | None, "cells along this axis [n]"]
MeshUnit = Annotated[Literal["m", "mm", "um"], "of the mesh file; all the rest is in SI"]
Fixed = Annotated[str | None, "components held besides, such as x@left,y@bottom: rollers, planes of symmetry"]
Law = Annotated[LawName, "stored energy; arap: as rigid as possible"]
Nu = Annotated[float, "Poisson's ratio at small strain"]
Constants = Annotated[
    str | None,
    "that are unknown: E,nu mu,lam K,G C10,C01,c .., with starts as in E:200GPa,nu:0.3 [mu,lam, or the law's]",
]
Modulus = Annotated[float | None, "Young's, to start from or known [1; fitted to a file's data]"]
Derivatives = Annotated[
    Literal["ad", "hand"] | None, "P, dP/dF, dP/dq by JAX or hand-derived in NumPy [hand where they exist]"
]
LoadKind = Annotated[Load, "dead; a grip's; along the deformed normal"]
Columns = Annotated[str | None, "of the file, x:NAME,ux:NAME; y:3mm for every row [by its header]"]
Units = Annotated[str | None, "of the file's columns, mm or x:mm,ux:um [the header's, else the mesh's]"]
OutsideOf = Annotated[Outside, "the file's points outside the body: an error, left out, or moved onto it"]
SupportOf = Annotated[
    Literal["clamp", "springs", "springs-nt"],
    "of the clamped face: held, or on springs of unknown stiffness per area k; k_n along its normal, k_t across it",
]
BoundaryOf = Annotated[
    Literal["zero", "measured"], "displacements of the clamped face, and of a grip: measured, the data that lie there"
]
ForceNoise = Annotated[float | str | None, "standard deviation of a force that is a datum [1 %] [N]"]
MotionOf = Annotated[MotionName, "of the camera or the grips, unknown, in the data: eliminated from J"]
Direction = Annotated[str | None, "of a dead load or a grip: x, -z, 0,0.6,0.8 or normal [the last axis]"]
Force = Annotated[float | None, "total on the loaded face, instead of traction=, or measured on a grip [N]"]
Noise = Annotated[float | str | None, "standard deviation of a file's data, added to a twin's [m], or 0.4um"]
StrainNoise = Annotated[float | str | None, "that of a file's strains exx,eyy,exy.. [1], or 20microstrain"]
Seed = Annotated[int, "of noise and markers"]
Alpha = Annotated[float, "weight of Phi"]
PhiWidth = Annotated[float, "jump of log E below which total variation is rounded"]
MarkerCount = Annotated[int, "points measured instead, at random on `face`"]
Components = Annotated[Literal["all", "in-plane"], "of a marker's displacement"]


def check(who: str, o: SimpleNamespace, axes: str) -> None:
    """Raises InputError for options (attributes of o) that are out of range or would be ignored; axes: xyz or xy."""
    _check_counts(who, o, axes)
    _check_applies(who, o, axes)
    _check_numbers(who, o)
    _check_unknown(who, o)


def lengths(who: str, size: str, count: int) -> tuple[float, ...]:
    """The `count` lengths [m] of `size`. Raises InputError."""
    try:
        L = [float(part) for part in str(size).split(",")]
    except ValueError:
        L = []
    if len(L) == 1:
        L *= count
    low, high = LENGTHS
    if len(L) != count or not all(low <= L_i <= high for L_i in L):
        several, example = {3: ("three", "1,2,0.5"), 2: ("two", "1,2")}[count]
        raise InputError(
            f"{who}: size={size} - give one length or {several}, such as {example}, from {low:g} to {high:g} m"
        )
    return tuple(L)


def _check_counts(who: str, o: SimpleNamespace, axes: str) -> None:
    along = [f"n{axis}" for axis in axes]
    for name in ("n", *along, "layers", "cases", "markers", "seed"):
        count, least = getattr(o, name), 0 if name in ("markers", "seed") else 1
        if count is not None and count < least:
            raise InputError(f"{who}: {name}={count} - choose {name} >= {least}")
    if o.cases > len(axes):
        order = ", ".join([axes[-1], *axes[:-1]])
        raise InputError(f"{who}: cases={o.cases} - there are 1 to {len(axes)}: along {order}")
    greatest = max(math.prod(getattr(o, name) or o.n for name in along), o.markers, o.layers or 0)
    if greatest > MAX_COUNT:
        raise InputError(f"{who}: {greatest:g} cells, markers or layers - at most {MAX_COUNT:g}")


def _check_applies(who: str, o: SimpleNamespace, axes: str) -> None:
    meshed, measured, gripped = o.mesh is not None, o.data not in (None, "twin"), o.load == "displacement"
    counts = {"n": o.n != 4} | {f"n{axis}": getattr(o, f"n{axis}") for axis in axes}
    at_data, forced = o.boundary == "measured", o.load == "traction" or (gripped and measured)
    stated = (o.constants or "").replace(" ", "")
    element = o.element != ("hex8" if axes == "xyz" else "quad4")
    check_applies(
        who,
        ("mesh", meshed, False, counts | {"size": o.size != "1"}),
        ("mesh", meshed, True, {"mesh_unit": o.mesh_unit != "m"}),
        ("mesh", meshed, False, {"element": element}),
        ("markers", o.markers > 0, True, {"face": o.face != "right", "components": o.components != "all"}),
        ("markers", o.markers > 0, False, {"sensors": o.sensors}),
        ("data=FILE", measured, True, {"columns": o.columns, "units": o.units, "outside": o.outside != "refuse"}),
        ("data=FILE", measured, True, {"boundary": at_data}),
        ("boundary=measured", at_data, False, {"support": o.support != "clamp"}),
        ("clamped", o.clamped != "none", True, {"support": o.support != "clamp"}),
        ("boundary=measured", at_data, False, {"displacement": o.displacement != 0.2}),
        ("load=displacement and data=FILE", gripped and measured, True, {"force_noise": o.force_noise is not None}),
        ("data=FILE", measured, True, {"strain_noise": o.strain_noise is not None}),
        ("load=follower", o.load == "follower", False, {"direction": o.direction}),
        ("cases", o.cases > 1, False, {"direction": o.direction}),
        ("load=traction, or a grip and data=FILE", forced, True, {"force": o.force is not None}),
        ("force", o.force is not None, False, {"traction": o.traction != 0.2}),
        ("data", o.data is not None, True, {"motion": o.motion != "none"}),
        ("data=FILE", measured, False, {"sensors": o.sensors, "markers": o.markers, "cases": o.cases > 1}),
        ("unknown=layers", o.unknown == "layers", True, {"layers": o.layers}),
        ("unknown=shape", o.unknown == "shape", True, {"surface": o.surface != "right"}),
        ("load=displacement", gripped, True, {"displacement": o.displacement != 0.2}),
        ("load=displacement", gripped, False, {"traction": o.traction != 0.2}),
        ("unknown=constants", o.unknown == "constants", True, {"constants": o.constants}),
        ("starts in constants", ":" in stated.replace("nu:", ""), False, {"modulus": o.modulus is not None}),
        ("starts in constants", "nu:" in stated, False, {"nu": o.nu != 0.3}),
        ("phi=tv", o.phi == "tv", True, {"phi_width": o.phi_width != PHI_WIDTH}),
        ("unknown=modulus or layers", o.unknown in FIELDS, True, {"phi": o.phi in ("tikhonov", "tv")}),
        ("unknown=modulus, layers or regions", o.unknown in MODULI, True, {"parametrization": o.parametrization}),
    )


def _check_numbers(who: str, o: SimpleNamespace) -> None:
    if not -1.0 < o.nu < 0.5 - 1e-9:
        raise InputError(f"{who}: nu={o.nu:g} - the laws are compressible, choose -1 < nu < 0.5")
    if o.modulus is not None and not 1e-30 <= o.modulus <= 1e30:
        raise InputError(f"{who}: modulus={o.modulus:g} Pa - choose one from 1e-30 to 1e30")
    if o.force is not None and not math.isfinite(o.force):
        raise InputError(f"{who}: force={o.force:g} - choose a finite one")
    if not (math.isfinite(o.traction) and math.isfinite(o.displacement)):
        raise InputError(f"{who}: traction={o.traction:g}, displacement={o.displacement:g} - choose finite ones")
    if standard_deviation(o.noise, o.data not in (None, "twin"), who) and o.data is None:
        raise InputError(f"{who}: noise={o.noise} - it is that of measured or synthetic data: data=FILE or data=twin")


def _check_unknown(who: str, o: SimpleNamespace) -> None:
    if o.unknown == "traction" and (o.load != "traction" or o.cases > 1):
        raise InputError(
            f"{who}: unknown=traction with load={o.load}, cases={o.cases} - it takes one case of load=traction"
        )
    if o.unknown == "load" and o.load == "displacement" and o.boundary == "measured":
        raise InputError(f"{who}: unknown=load with boundary=measured - the displacements of the grip are known")
    if o.derivatives == "hand" and o.unknown not in MATERIAL:
        raise InputError(f"{who}: derivatives=hand are by material constants, not by {o.unknown} - take derivatives=ad")
