"""The block: a hyperelastic body on a clamped face, loaded on another; the problem people have."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from problems import bodies, probes, unknowns
from problems.bodies import Body
from problems.elements import ElementName, Facets
from problems.errors import InputError
from problems.problem import Array, Fields, Linearization, Offers, Operator, Parameters, ParameterView, Problem, Traced
from problems.sparse import BlockDiagonal, GeneralPattern, SymmetricPattern
from problems.supports import Supports, check_clamp
from problems.unknowns import Setting, Unknown, UnknownName

if TYPE_CHECKING:
    from problems.materials import Law
    from problems.solid import CompiledResidual, Solid

LawName = Literal["neo-hookean", "mooney-rivlin", "yeoh", "ogden", "linear"]
DIRECTIONS = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # of load case 1, 2, 3
ACROSS = 0.25  # of the traction: pushed sideways a block bends, and far
TARGET = 0.2  # of the body's height: how far the top should go, where nobody has measured


class Block(Problem):
    """A block of compressible rubber, pulled at its top: moduli, loads or its shape sought from displacements.

    State u (n_u,) [m], free displacement components, node by node, one load case after the other. Without data, J asks
    for the displacement (0, 0, 0.2 z) in units of the height, along x in the second load case and y in the third.
    """

    name = "block"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX

    def __init__(
        self,
        *,
        n: Annotated[int, "cells along every edge"] = 4,
        nx: Annotated[int | None, "cells along x [n]"] = None,
        ny: Annotated[int | None, "cells along y [n]"] = None,
        nz: Annotated[int | None, "cells along z [n]"] = None,
        size: Annotated[str, "lengths Lx,Ly,Lz [m], or one for all"] = "1",
        element: Annotated[ElementName, "of the box; tetrahedra split each of its bricks in six"] = "hex8",
        mesh: Annotated[str | None, "mesh file of hexahedra or tetrahedra that meshio reads [the box]"] = None,
        clamped: Annotated[str, "face held: a name (bottom, top, left, ... or the file's) or a plane, z=0"] = "bottom",
        loaded: Annotated[str, "face loaded or gripped"] = "top",
        law: Annotated[LawName, "stored energy"] = "neo-hookean",
        nu: Annotated[float, "Poisson's ratio at small strain"] = 0.3,
        derivatives: Annotated[Literal["ad", "hand"], "P, dP/dF, dP/dq by JAX or hand-derived in NumPy"] = "ad",
        unknown: Annotated[UnknownName, "what p is"] = "modulus",
        parametrization: Annotated[Literal["log", "raw"] | None, "of moduli: p = log E or p = E [log]"] = None,
        layers: Annotated[int, "layers along z, for unknown=layers"] = 4,
        surface: Annotated[str, "face whose nodes move, for unknown=shape"] = "right",
        load: Annotated[
            Literal["traction", "displacement", "follower"], "dead; a grip's; along the deformed normal"
        ] = "traction",
        traction: Annotated[float, "on the loaded face, in z or along the normal [Pa]"] = 0.2,
        displacement: Annotated[float, "of the grip, in z [m]"] = 0.2,
        cases: Annotated[int, "load cases: in z, x, y (tractions across: 1/4); a follower's: 1, 1/2, 1/3"] = 1,
        sensors: Annotated[str | None, "face whose nodes are measured [loaded; right where a grip holds it]"] = None,
        markers: Annotated[int, "points measured instead, at random on `face`"] = 0,
        face: Annotated[str, "that carries the markers"] = "right",
        components: Annotated[Literal["all", "in-plane"], "of a marker's displacement"] = "all",
        data: Annotated[str | None, "CSV file x,y,z,ux,uy,uz; twin: made by a stiff inclusion [the target]"] = None,
        noise: Annotated[float, "standard deviation added to a twin's data [m]"] = 0.0,
        seed: Annotated[int, "of noise and markers"] = 0,
    ) -> None:
        _check(n=n, nx=nx, ny=ny, nz=nz, layers=layers, cases=cases, markers=markers, seed=seed)
        if not -1.0 < nu < 0.5:
            raise InputError(f"block: nu={nu:g} - the laws are compressible, choose -1 < nu < 0.5")
        if not (math.isfinite(traction) and math.isfinite(displacement)):
            raise InputError(f"block: traction={traction:g}, displacement={displacement:g} - choose finite ones")
        if noise < 0 or not math.isfinite(noise) or (noise and data != "twin"):
            raise InputError(f"block: noise={noise:g} - choose noise >= 0, for synthetic data (data=twin) only")
        if parametrization is not None and unknown not in ("modulus", "layers"):
            raise InputError(
                f"block: parametrization={parametrization} - unknown={unknown} has no moduli, leave it out"
            )
        if unknown == "traction" and (load != "traction" or cases > 1):
            raise InputError(
                f"block: unknown=traction with load={load}, cases={cases} - it takes one case of load=traction"
            )
        if derivatives == "hand" and unknown not in ("modulus", "layers", "constants"):
            raise InputError(
                f"block: derivatives=hand are by material constants, not by {unknown} - take derivatives=ad"
            )
        self.law_name, self.nu, self.hand = law, nu, derivatives == "hand"
        self.load_kind, self.unknown_name = load, unknown
        if self.hand and self.law.hand is None:
            raise InputError(f"block: derivatives=hand exist for neo-hookean and mooney-rivlin, not {law} - take ad")
        self.law.check(self.law.of_modulus(1.0, nu))
        cells, lengths = (nx or n, ny or n, nz or n), _lengths(size)
        self.body: Body = bodies.read("block", mesh) if mesh else bodies.box("block", element, cells, lengths)
        self.loaded: Facets = self.body.surface(loaded)
        held = np.zeros(0, dtype=int) if clamped == "none" else self.body.surface(clamped).node_set
        check_clamp(self.body, held)
        self.directions = DIRECTIONS[:cases].copy()
        if load == "traction":
            self.directions[1:] *= ACROSS
        gripped = np.setdiff1d(self.loaded.node_set, held) if load == "displacement" else np.zeros(0, dtype=int)
        self.supports = Supports.of(self.body, held, gripped, self.directions)
        self.clamped, self.gripped = held, gripped
        self.amplitude = displacement if load == "displacement" else traction
        blank, log = data == "twin", parametrization != "raw"
        self.log = log
        self.unknown: Unknown = {
            "modulus": lambda: unknowns.moduli(self.body, self.law, nu, log, blank),
            "layers": lambda: unknowns.layers(self.body, self.law, nu, log, blank, layers),
            "constants": lambda: unknowns.constants(self.body, self.law, nu),
            "traction": lambda: unknowns.tractions(self.body, self.loaded, traction),
            "shape": lambda: unknowns.shape(self.body, surface, np.union1d(held, self.loaded.node_set)),
            "load": lambda: unknowns.amplitude(load, self.amplitude, "m" if load == "displacement" else "Pa"),
        }[unknown]()
        self.parameters: Parameters = self.unknown.parameters
        self.n_state = self.supports.n_u
        self.linear = law == "linear" and load != "follower"
        self.structure = "general" if load == "follower" else "spd"
        self.offset = float(np.abs(self.body.box).max())  # positions are what displacements are added to
        self.matrix_free = not self.hand
        self.twin_data, self.noise, self.seed = data == "twin", noise, seed
        self._place_sensors(sensors, markers, face, components == "in-plane", data)
        if self.amplitude == 0.0 and unknown != "load":
            self.notes += ("zero load: u = 0, and no gradient tells anything about the material",)

    def _place_sensors(self, where: str | None, markers: int, face: str, in_plane: bool, data: str | None) -> None:
        """S and d (cases, m, 3); d is None for a twin whose state is still to be solved for."""
        body = self.body
        if data is not None and data != "twin":
            if markers or where is not None or len(self.directions) > 1:
                raise InputError(
                    "block: data=FILE holds its own points and one load case - leave out sensors, markers, cases"
                )
            self.probes, d = probes.measured(body, data)
            self.d: Array | None = d[None]
            if (greatest := float(np.abs(d).max())) > body.size:
                self.notes += (f"data up to {greatest:.3g} m for a body of {body.size:.3g} m: are the units right?",)
            return
        if markers:
            self.probes = probes.markers(body, face, markers, in_plane, self.seed)
        else:
            default = "right" if self.load_kind == "displacement" else None
            facets = self.loaded if where is default is None else body.surface(where or str(default))
            self.probes = probes.at_nodes(body, facets.node_set)
        height = TARGET * (self.probes.x[:, 2] - body.box[0, 2])
        target = height[None, :, None] * self.directions[:, None]
        self.d = None if data == "twin" else np.broadcast_to(target, (len(self.directions), len(height), 3))

    # --- p

    @cached_property
    def law(self) -> Law:
        from problems.materials import LAWS

        return LAWS[self.law_name]

    @cached_property
    def _default(self) -> Setting:
        E = unknowns.default_modulus(self.body.relative(self.body.geometry.centres))
        return Setting(self.law.of_modulus(E, self.nu), self.body.geometry.X, np.float64(self.amplitude))

    def setting(self, p: Any, xp: Any = np) -> Setting:
        """Constants of the law, positions of the nodes and load at p."""
        return self.unknown.apply(self._default, p, xp)

    def metric(self, s: Setting, xp: Any) -> tuple[Any, Any]:
        """dN, dx of the cells; worked out anew only where p moves the nodes."""
        geometry = self.body.geometry
        return geometry.metric if s.X is geometry.X else geometry.at(s.X, xp)

    def displacements(self, u: Any, s: Setting, case: int, nodes: Array, xp: Any = np) -> Any:
        a = s.load if self.load_kind == "displacement" else 0.0 * self._default.load
        return self.supports.displacements(u, a, case, nodes, xp)

    # --- the physics, once

    def potential(self, u: Any, p: Any) -> Any:
        """Pi(u, p) [N m], stored energy less the work of dead tractions; traceable."""
        from problems.jax64 import jnp

        s = self.setting(p, jnp)
        dN, dx = self.metric(s, jnp)
        Pi = 0.0
        for case in range(len(self.directions)):
            Pi += self.solid.energy(self.displacements(u, s, case, self.body.geometry.nodes, jnp), s.q, dN, dx)
            if self.load_kind == "traction":
                f = self.dead_forces(s, case, jnp)
                Pi -= (f * self.displacements(u, s, case, self.loaded.nodes, jnp)).sum()
        return Pi

    def dead_forces(self, s: Setting, case: int, xp: Any) -> Any:
        """Of the traction on the loaded facets, node by node: (n_f, n_a, 3) [N]."""
        t = s.load if s.load.ndim == 2 else s.load * self.directions[case][None]  # (n_f or 1, 3)
        return xp.einsum("fqa,fq->fa", self.loaded.N, self.loaded.areas(s.X, xp))[..., None] * t[:, None]

    def follower_forces(self, u_f: Any, s: Setting, case: int, xp: Any) -> Any:
        """The same of a traction along the deformed normal, u_f (n_f, n_a, 3) the facets' displacements."""
        normals = self.loaded.normals(s.X[self.loaded.nodes] + u_f, xp)
        return s.load / (1.0 + case) * xp.einsum("fqa,fqi->fai", self.loaded.N, normals)

    def follower(self, u: Any, p: Any) -> Any:
        """-f_ext (n_u,) of a load that has no potential; traceable."""
        from problems.jax64 import jnp

        s, n, facets = self.setting(p, jnp), self.supports.n_free, self.loaded
        parts = []
        for case, index in enumerate(self.supports.index):
            f = self.follower_forces(self.displacements(u, s, case, facets.nodes, jnp), s, case, jnp)
            parts.append(-jnp.zeros(n + 2, f.dtype).at[index[facets.nodes]].add(f)[:n])
        return jnp.concatenate(parts)

    @cached_property
    def solid(self) -> Solid:
        from problems.solid import Solid

        return Solid(self.law.W)

    @cached_property
    def _compiled(self) -> CompiledResidual:
        from problems.solid import CompiledResidual

        return CompiledResidual(self.potential, self.follower if self.load_kind == "follower" else None)

    # --- the contract

    def initial(self, p: Array) -> Array:
        """Zero; where a grip moves, every node goes along as far as it is near to it."""
        u = np.zeros(self.n_state, dtype=p.dtype)
        if not self.gripped.size:
            return u
        a = self.setting(p).load
        for case, direction in enumerate(self.directions):
            moved = self._nearness[:, None] * direction * a
            index = self.supports.index[case]
            free = index < self.supports.n_free
            u[case * self.supports.n_free + index[free]] = moved[free]
        return u

    @cached_property
    def _nearness(self) -> Array:
        """(n_nodes,), 0 at the clamp, 1 at the grip."""
        from scipy.spatial import cKDTree

        X = self.body.geometry.X
        to_clamp, to_grip = (cKDTree(X[nodes]).query(X)[0] for nodes in (self.clamped, self.gripped))
        return np.asarray(to_clamp / (to_clamp + to_grip))

    def load(self, p: Array) -> Array:
        return -self.residual(self.initial(p), p)

    def residual(self, u: Array, p: Array) -> Array:
        return self._by_hand.residual(u, p) if self.hand else self._compiled(u, p)

    def tangent(self, u: Array, p: Array) -> Any:
        s = self.setting(p)
        metric, nodes = self.metric(s, np), self.body.geometry.nodes
        blocks = []
        for case in range(len(self.directions)):
            u_e = self.displacements(u, s, case, nodes)
            K = (self._by_hand if self.hand else self.solid).tangents(u_e, s.q, *metric, self._pick)
            if self.load_kind == "follower":
                u_f = self.displacements(u, s, case, self.loaded.nodes)
                np.subtract.at(K, self.loaded.cells, self._follower_tangents(u_f, s, case))
            blocks.append(self.pattern.assemble(K))
        return blocks[0] if len(blocks) == 1 else BlockDiagonal(tuple(blocks))

    @cached_property
    def pattern(self) -> SymmetricPattern | GeneralPattern:
        geometry, n = self.body.geometry, self.supports.n_free
        unknowns = self.supports.unknowns(geometry.nodes)
        if self.structure == "general":
            return GeneralPattern.of_elements(unknowns, n)
        return SymmetricPattern.of_elements(unknowns, n, self.supports.rigid_motions(geometry.X))

    @cached_property
    def _pick(self) -> Array:
        """The entries of an element matrix that the pattern takes."""
        m = 3 * self.body.geometry.nodes.shape[1]
        i, j = np.triu_indices(m)
        return np.arange(m * m) if self.structure == "general" else i * m + j

    def _follower_tangents(self, u_f: Array, s: Setting, case: int) -> Array:
        """df_ext/du_f, (n_f, (3 n_a)^2)."""
        return np.asarray(self._follower_derivative(u_f, s.load, s.X, case)).reshape(len(u_f), -1)

    @cached_property
    def _follower_derivative(self) -> Callable[..., Any]:
        from problems.jax64 import jax, jnp

        def forces(u_f: Any, load: Any, X: Any, case: int) -> Any:
            return self.follower_forces(u_f, Setting((), X, load), case, jnp)

        def columns(u_f: Any, load: Any, X: Any, case: int) -> Any:
            """Facets do not know each other: one product gives a column of every facet's matrix."""
            m = 3 * u_f.shape[1]
            units = jnp.broadcast_to(jnp.eye(m, dtype=u_f.dtype).reshape(m, 1, *u_f.shape[1:]), (m, *u_f.shape))
            along = jax.vmap(lambda v: jax.jvp(lambda u_f: forces(u_f, load, X, case), (u_f,), (v,))[1])(units)
            return jnp.moveaxis(along, 0, -1)  # (n_f, n_a, 3, m)

        return jax.jit(columns, static_argnums=3)

    def tangent_operator(self, u: Array, p: Array) -> Operator:
        return self._compiled.by_u(u, p)

    def objective(self, u: Any, p: Any, xp: Any = np) -> Any:
        """J = 1/2 sum over load cases of |S u - d|^2 [m^2]."""
        s, d = self.setting(p, xp), self._data()
        return sum(
            self.probes.misfit(self.displacements(u, s, case, self.probes.nodes, xp), d[case]) for case in range(len(d))
        )

    def _data(self) -> Array:
        if self.d is None:
            raise InputError(
                "block: data=twin are not made yet - solve for them: routes.twin.with_synthetic_data(block)"
            )
        return self.d

    def linearize(self, u: Array, p: Array) -> Linearization:
        s, d = self.setting(p), self._data()
        parts, by_grip = [], 0.0
        for case in range(len(d)):
            S_T_r = self.probes.misfit_gradient(self.displacements(u, s, case, self.probes.nodes), d[case])
            by_u, by_a = self.supports.gather(S_T_r, self.probes.nodes, case)
            parts.append(by_u)
            by_grip += by_a
        moved = self.load_kind == "displacement" and self.unknown_name == "load"
        J_p = np.full_like(p, by_grip) if moved else np.zeros_like(p)
        R_p = self._by_hand.by_p(u, p) if self.hand else self._compiled.by_p(u, p)
        return Linearization(R_p, np.concatenate(parts), J_p)

    @cached_property
    def _by_hand(self) -> Any:
        from problems.hand_solid import HandSolid

        return HandSolid(self)

    def traced(self) -> Traced:
        from problems.jax64 import jnp

        return Traced(residual=self._compiled.R, objective=lambda u, p: self.objective(u, p, jnp))

    # --- synthetic data

    def truth(self) -> Array | None:
        return self.unknown.truth if self.twin_data else None

    def twin(self) -> Block | None:
        return self._with_data(np.zeros((len(self.directions), *self.probes.x.shape))) if self.d is None else None

    def observed(self, u: Array) -> Block:
        s = self.setting(self.unknown.truth)
        U = [self.displacements(u, s, case, self.probes.nodes) for case in range(len(self.directions))]
        d = np.stack([self.probes.read(U_case) for U_case in U])
        return self._with_data(d + self.noise * np.random.default_rng(self.seed).standard_normal(d.shape))

    def _with_data(self, d: Array) -> Block:
        other = copy.copy(self)  # shares the geometry and what is compiled: no data in it
        other.d = d
        return other

    # --- what a person looks at

    def fields(self, p: Array, u: Array, lam: Array | None, gradient: Array) -> Fields:
        """u and lam (n_nodes, 3) of every load case; E and dJ/dE of every cell, dJ/dX of every node, as p has them."""
        s, geometry = self.setting(p), self.body.geometry
        every = np.arange(len(geometry.X))
        vectors = {"u": (u, s)} if lam is None else {"u": (u, s), "lambda": (lam, replace(s, load=0.0 * s.load))}
        point_data, cell_data = {}, {}
        for case in range(len(self.directions)):
            suffix = f"_{case + 1}" if len(self.directions) > 1 else ""
            for name, (v, at) in vectors.items():
                point_data[name + suffix] = self.displacements(v, at, case, every)
        if self.unknown.group is not None:
            E = np.exp(p) if self.log else p
            cell_data = {
                "E": E[self.unknown.group],
                "dJ_dE": (gradient / E if self.log else gradient)[self.unknown.group],
            }
        if self.unknown.nodes is not None:
            point_data["dJ_dX"] = np.zeros_like(s.X)
            point_data["dJ_dX"][self.unknown.nodes] = gradient.reshape(-1, 3)
        return Fields(s.X, *geometry.for_meshio(), point_data, cell_data)

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        x = self.parameters.position
        return ParameterView() if x is None else ParameterView(dict(zip("xyz", x.T, strict=True)))


def _check(**counts: int | None) -> None:
    least = {"markers": 0, "seed": 0}
    for name, count in counts.items():
        if count is not None and count < least.get(name, 1):
            raise InputError(f"block: {name}={count} - choose {name} >= {least.get(name, 1)}")
    if (counts["cases"] or 0) > len(DIRECTIONS):
        raise InputError(f"block: cases={counts['cases']} - there are 1 to {len(DIRECTIONS)}: along z, x, y")


def _lengths(size: str) -> tuple[float, float, float]:
    try:
        lengths = [float(part) for part in str(size).split(",")]
    except ValueError:
        lengths = []
    if len(lengths) == 1:
        lengths *= 3
    if len(lengths) != 3 or not all(0 < L < math.inf for L in lengths):
        raise InputError(f"block: size={size} - give one length or three, such as 1,2,0.5, all > 0")
    return lengths[0], lengths[1], lengths[2]
