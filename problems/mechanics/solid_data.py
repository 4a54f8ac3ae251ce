"""Data of a solid: those of a file, or target displacements at nodes or markers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from gradient_routes.problems.data import probes
from gradient_routes.problems.data.displacement_data import DisplacementData
from gradient_routes.problems.data.units import standard_deviation
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.boundary_conditions import nodes_of_faces
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.mechanics.design_variables import MATERIAL
from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid
from gradient_routes.problems.mechanics.measured_boundary import force_data, in_words
from gradient_routes.problems.mechanics.supports import Supports
from gradient_routes.problems.problem import Array

TARGET = 0.2  # displacement wanted at the top, per height


def read_file(mesh: Mesh, o: SimpleNamespace, noise: float, known: Array) -> probes.Measured:
    """The file `data` of the options; points that tell the displacements of the nodes `known` are no data."""
    strain_noise = standard_deviation(o.strain_noise, True, mesh.who, "ratio", "strain_noise")
    return probes.read_probes(mesh, o.data, o.columns, o.units, o.outside, noise, known, strain_noise)


def data_of(
    o: SimpleNamespace,
    solid: LoadedSolid,
    supports: Supports,
    found: probes.Measured | None,
    F: Array | None,
    noise: float,
) -> tuple[DisplacementData, tuple[str, ...]]:
    """The data, those `found` in a file and forces F (cases,) [N] among them, and notes on how they were read.

    Raises InputError.
    """
    notes: tuple[str, ...] = ()
    if found is None:
        data = _targets(solid, _points(o, solid.mesh), noise, synthetic=o.data == "twin")
    else:
        data, notes = _from_file(o, solid, supports.clamp, found, F)
    data = data.with_motion(o.motion)
    if data.reads_nothing():
        raise InputError(
            f"{solid.mesh.who}: all that is measured is held at zero and tells nothing - choose other points"
        )
    return data, notes


def _points(o: SimpleNamespace, mesh: Mesh) -> probes.Probes:
    if o.markers:
        return probes.markers(mesh, o.face, o.markers, o.components == "in-plane", o.seed)
    where = o.sensors or ("right" if o.load == "displacement" else o.loaded)
    nodes = np.unique(mesh.geometry.nodes) if where == "everywhere" else mesh.boundary(where).node_set
    return probes.at_nodes(mesh, nodes)


def _targets(solid: LoadedSolid, points: probes.Probes, noise: float, synthetic: bool) -> DisplacementData:
    """The target displacements; none yet for synthetic data."""
    height = TARGET * (points.x[:, -1] - solid.mesh.bounding_box[0, -1])
    target = tuple(height[:, None] * direction for direction in solid.directions)
    cases = (points,) * len(solid.directions)
    return DisplacementData(solid, cases, None if synthetic else target, noise)


def _from_file(
    o: SimpleNamespace, solid: LoadedSolid, clamp: Array, measured: probes.Measured, F: Array | None
) -> tuple[DisplacementData, tuple[str, ...]]:
    who = solid.mesh.who
    said = [*measured.notes, *([in_words(measured.boundary, solid.symmetric)] if measured.boundary else [])]
    if measured.strains is not None and solid.design.moved_nodes is not None:
        raise InputError(f"{who}: strains are read in a mesh that stands still, not with unknown=shape")
    data = DisplacementData(solid, measured.probes, measured.d, measured.sigma, strains=measured.strains)
    if F is not None:
        d = np.concatenate([d[at.measured] for at, d in zip(measured.probes, measured.d, strict=True)])
        if not d.size:
            raise InputError(f"{who}: force= of a grip is weighed beside displacements - measure some, too")
        rms = float(np.sqrt(np.mean(d**2)))
        apart = np.union1d(clamp, nodes_of_faces(solid.mesh, o.clamped))
        force, note = force_data(solid, F, solid.directions[0], apart, o.force_noise, measured.sigma, rms)
        return replace(data, force=force), (*said, note)
    if o.force_noise is not None:
        raise InputError(f"{who}: force_noise= is that of force=, which is not given - give both or none")
    if solid.load == "displacement" and o.unknown in MATERIAL:
        said.append("displacements alone tell ratios of moduli; their size stays that of the start: give force=")
    return data, tuple(said)
