"""The data term for solids: displacements at probes in every load case against measurements."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.data.force_data import ForceData
from gradient_routes.problems.data.motion import Motion, MotionName, check
from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.probes import Probes
from gradient_routes.problems.data.strain_gauges import StrainGauges
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.mesh import AXES
from gradient_routes.problems.mechanics.design_variables import Setup
from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid
from gradient_routes.problems.problem import Array

NO_WEIGHT = 1e-9  # shape functions that are 0 but for rounding


@dataclass(frozen=True, eq=False)
class DisplacementData:
    """S and d of J = 1/2 sum over load cases of |S u - d|^2 [m^2].

    All of these for every load case:
    probes    where displacements are read
    d (m, d)  [m], None for synthetic data that are not computed yet
    motions   what is eliminated from J
    noise     standard deviation of the noise on d [m]
    strains   measured besides, in one load case; noise is theirs where no displacement was measured
    force     what is measured of forces besides
    """

    solid: LoadedSolid
    probes: tuple[Probes, ...]
    d: tuple[Array, ...] | None
    noise: float = 0.0
    motions: tuple[Motion, ...] | None = None
    strains: StrainGauges | None = None
    force: ForceData | None = None

    def with_motion(self, kind: MotionName) -> DisplacementData:
        """With a motion to eliminate in each case. Raises InputError for data that are all motion."""
        turns, who = self.solid.mesh.geometry.axisymmetric, self.solid.mesh.who
        if kind == "none":
            return self
        if not any(at.measured.any() for at in self.probes):
            raise InputError(f"{who}: motion={kind} is of displacements, and none were measured - leave it out")
        motions = tuple(Motion.of(kind, at.x, at.measured, at.weights, turns) for at in self.probes)
        if self.d is not None:
            check(
                motions, [at.residual(0.0 * at.N[..., None], d) for at, d in zip(self.probes, self.d, strict=True)], who
            )
        return replace(self, motions=motions)

    def require_data(self) -> tuple[Array, ...]:
        """d. Raises InputError for synthetic data that are not computed yet."""
        if self.d is None:
            raise InputError(
                f"{self.solid.mesh.who}: data=twin are not made yet - solve for them:"
                " gradient_routes.routes.synthetic_data.with_synthetic_data(block)"
            )
        return self.d

    def zeros(self) -> DisplacementData:
        """With d = 0, to solve for the state that synthetic data are read from."""
        return replace(self, d=tuple(np.zeros(at.x.shape) for at in self.probes))

    def synthesized(self, u: Array, s: Setup, rng: np.random.Generator) -> DisplacementData:
        """With the data that the probes read from u, plus noise."""
        read = (self.probes[case].read(U) for case, U in enumerate(self._probe_displacements(u, s)))
        return replace(self, d=tuple(d + self.noise * rng.standard_normal(d.shape) for d in read))

    def single_case(self, case: int) -> DisplacementData:
        """The data of one load case."""
        of = slice(case, case + 1)
        motions = None if self.motions is None else self.motions[of]
        force = None if self.force is None else self.force.single_case(case)
        solid, d = self.solid.single_case(case), self.require_data()[of]
        return replace(self, solid=solid, probes=self.probes[of], d=d, motions=motions, force=force)

    def reads_nothing(self) -> bool:
        """Whether all that is measured is held at zero."""
        bc, strains = self.solid.bc, self.strains
        for case, at in enumerate(self.probes):
            seen = (np.abs(at.N) > NO_WEIGHT)[..., None] & at.measured[:, None]
            if (seen & (bc.index[case][at.nodes] != bc.n_free)).any():
                return False
        return strains is None or not (bc.index[0][strains.nodes] != bc.n_free).any()

    def misfit(self, u: Any, p: Any, xp: Any = np) -> Any:
        besides = [] if self.force is None else self.force.residuals(u, p, xp)
        if self.strains is not None:
            besides.append(self._strain_residual(u, self.solid.setup(p, xp), xp))
        return sum(0.5 * (r**2).sum() for r in (*self._residuals(u, p, xp), *besides))

    def _strain_residual(self, u: Any, s: Setup, xp: Any = np) -> Any:
        assert self.strains is not None
        return self.strains.residual(self.solid.displacements(u, s, 0, self.strains.nodes, xp))

    def _residuals(self, u: Any, p: Any, xp: Any = np) -> list[Any]:
        """P w (S u - d), (m,), of every load case."""
        d, U = self.require_data(), self._probe_displacements(u, self.solid.setup(p, xp), xp)
        plain = [at.residual(U[case], d[case]) for case, at in enumerate(self.probes)]
        if self.motions is None:
            return plain
        return [motion.projected(r) for motion, r in zip(self.motions, plain, strict=True)]

    def moved(self, u: Array, p: Array) -> dict[str, float]:
        """The motion that is eliminated, by name."""
        if self.motions is None:
            return {}
        d, U = self.require_data(), self._probe_displacements(u, self.solid.setup(p))
        found = [m.of_residual(self.probes[k].residual(U[k], d[k])) for k, m in enumerate(self.motions)]
        several = len(found) > 1
        return {f"{name}, case {k + 1}" if several else name: m for k, of in enumerate(found) for name, m in of.items()}

    def misfit_gradient(self, u: Array, p: Array) -> tuple[Array, Array]:
        """Derivatives of the misfit with respect to u (n_u,) and p (n_p,)."""
        bc = self.solid.bc
        parts = [
            bc.assemble(at.forces(r), at.nodes, case)
            for case, (at, r) in enumerate(zip(self.probes, self._residuals(u, p), strict=True))
        ]
        if self.strains is not None:
            r = self._strain_residual(u, self.solid.setup(p))
            more = bc.assemble(self.strains.forces(r), self.strains.nodes, 0)
            parts = [(parts[0][0] + more[0], parts[0][1] + more[1])]
        by_u = np.concatenate([of_case for of_case, _ in parts])
        by_p = np.zeros_like(p)
        if self.solid.grip_is_parameter:
            by_p[0] = sum(by_a for _, by_a in parts)
        if self.force is None:
            return by_u, by_p
        more_by_u, more_by_p = self.force.misfit_gradient(u, p)
        return by_u + more_by_u, by_p + more_by_p

    def observation(self, u: Array, p: Array) -> Observation:
        d, U = self.require_data(), self._probe_displacements(u, self.solid.setup(p))
        S_u, S_a = self._sampling_matrix
        predicted = np.concatenate([at.read(U[case])[at.measured] for case, at in enumerate(self.probes)])
        data = np.concatenate([d[case][at.measured] for case, at in enumerate(self.probes)])
        S_p = np.pad(S_a, ((0, 0), (0, len(p) - 1))) if self.solid.grip_is_parameter else None
        position = np.concatenate([at.x[np.nonzero(at.measured)[0]] for at in self.probes])
        quantity = np.concatenate([self._quantities(case) for case in range(len(self.probes))])
        seen = Observation(predicted, data, S_u, S_p, self.noise, self._label, position=position, quantity=quantity)
        if self.probes[0].weights is not None:
            weights = [at.weights[at.measured] for at in self.probes if at.weights is not None]
            seen = seen.weighted(np.concatenate(weights))
        if self.strains is not None:
            seen = self._with_strains(seen, u, p)
        if self.force is not None:
            seen = self.force.beside(seen, u, p)
        return seen if self.motions is None else seen.without(self.motions)

    def _with_strains(self, seen: Observation, u: Array, p: Array) -> Observation:
        """The rows of strains below those of displacements; one load case."""
        from scipy import sparse

        gauges, bc = self.strains, self.solid.bc
        assert gauges is not None
        w, measured = gauges.weight, gauges.measured
        S = w * gauges.matrix(bc.index[0], bc.size)
        U = self.solid.displacements(u, self.solid.setup(p), 0, gauges.nodes)
        S_p = None
        if seen.S_p is not None:
            by_a = S[:, bc.grip] @ bc.directions[0][:, None]
            S_p = np.concatenate([seen.S_p, np.pad(by_a, ((0, 0), (0, len(p) - 1)))])
        before = len(seen.data)
        quantity, x = gauges.quantities, gauges.positions
        assert seen.position is not None
        assert seen.quantity is not None

        def label(k: int) -> str:
            return (
                seen.label(k)
                if k < before
                else f"{quantity[k - before]} at ({', '.join(f'{c:.3g}' for c in x[k - before])})"
            )

        return replace(
            seen,
            predicted=np.concatenate([seen.predicted, w * gauges.read(U)[measured]]),
            data=np.concatenate([seen.data, w * gauges.e[measured]]),
            S_u=sparse.vstack([seen.S_u, S[:, : bc.n_free]], format="csr"),
            S_p=S_p,
            label=label,
            relative=np.concatenate([np.broadcast_to(seen.relative, before), np.full(len(quantity), w)]),
            position=np.concatenate([seen.position, x]),
            quantity=np.concatenate([seen.quantity, quantity]),
        )

    def candidates(self) -> Candidates:
        """Every free displacement component of every node, in every load case."""
        bc, X = self.solid.bc, self.solid.mesh.geometry.X
        case, node, component = np.nonzero(bc.index < bc.n_free)
        at = case * bc.n_free + bc.index[case, node, component]
        return Candidates(at, lambda j: self._name(int(component[j]), X[node[j]], int(case[j])), X[node])

    @property
    def _cases(self) -> int:
        return len(self.solid.directions)

    def _probe_displacements(self, u: Any, s: Setup, xp: Any = np) -> list[Any]:
        """Displacements of the probes' nodes, (m, k, d) per load case."""
        return [self.solid.displacements(u, s, case, at.nodes, xp) for case, at in enumerate(self.probes)]

    @cached_property
    def _sampling_matrix(self) -> tuple[Any, Array]:
        """The rows of S for u (m, n_u), sparse, and for the grip displacement (m, 1)."""
        from scipy import sparse

        bc, blocks, grips = self.solid.bc, [], []
        for case, probes in enumerate(self.probes):
            points, components = np.nonzero(probes.measured)
            at = bc.index[case][probes.nodes[points], components[:, None]]  # (m, k)
            rows = np.broadcast_to(np.arange(len(points))[:, None], at.shape)
            entries = (probes.N[points].ravel(), (rows.ravel(), at.ravel()))
            S = sparse.csr_array(entries, shape=(len(points), bc.size))
            blocks.append(S[:, : bc.n_free])
            grips.append(S[:, bc.grip] @ bc.directions[case][:, None])
        return sparse.block_diag(blocks, format="csr"), np.concatenate(grips)

    @cached_property
    def _starts(self) -> Array:
        """The number of the first datum of each load case."""
        return np.cumsum([0, *(np.count_nonzero(at.measured) for at in self.probes)])

    def _label(self, k: int) -> str:
        case = int(np.searchsorted(self._starts, k, side="right")) - 1
        probes = self.probes[case]
        points, components = np.nonzero(probes.measured)
        i = k - self._starts[case]
        return self._name(int(components[i]), probes.x[points[i]], case)

    def _quantities(self, case: int) -> Array:
        names = [f"u{axis}{self._of_case(case)}" for axis in AXES[: self.probes[case].x.shape[1]]]
        return np.array(names)[np.nonzero(self.probes[case].measured)[1]]

    def _of_case(self, case: int) -> str:
        return f", case {case + 1}" if len(self.probes) > 1 else ""

    def _name(self, component: int, x: Array, case: int) -> str:
        return f"u_{AXES[component]} at ({', '.join(f'{x_i:.3g}' for x_i in x)}){self._of_case(case)}"
