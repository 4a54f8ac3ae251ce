"""The data term for solids: displacements at probes in every load case against measurements."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.data.motion import Motion
from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.probes import Probes
from gradient_routes.problems.data.strain_gauges import StrainGauges
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.mesh import AXES
from gradient_routes.problems.mechanics.design_variables import Setup
from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid
from gradient_routes.problems.problem import Array


@dataclass(frozen=True, eq=False)
class DisplacementData:
    """S and d of J = 1/2 sum over load cases of |S u - d|^2 [m^2].

    d (cases, m, d)  [m], None for synthetic data that are not computed yet
    noise            standard deviation of the noise on d [m]
    motion           what is eliminated from J, in every load case for itself
    strains          measured besides, in one load case; noise is theirs where no displacement was measured
    """

    solid: LoadedSolid
    probes: Probes
    d: Array | None
    noise: float = 0.0
    motion: Motion | None = None
    strains: StrainGauges | None = None

    def require_data(self) -> Array:
        """d. Raises InputError for synthetic data that are not computed yet."""
        if self.d is None:
            raise InputError(
                f"{self.solid.mesh.who}: data=twin are not made yet - solve for them:"
                " gradient_routes.routes.synthetic_data.with_synthetic_data(block)"
            )
        return self.d

    def zeros(self) -> DisplacementData:
        """With d = 0, to solve for the state that synthetic data are read from."""
        return replace(self, d=np.zeros((self._cases, *self.probes.x.shape)))

    def synthesized(self, u: Array, s: Setup, rng: np.random.Generator) -> DisplacementData:
        """With the data that the probes read from u, plus noise."""
        d = np.stack([self.probes.read(U) for U in self._probe_displacements(u, s)])
        return replace(self, d=d + self.noise * rng.standard_normal(d.shape))

    def single_case(self, case: int) -> DisplacementData:
        """The data of one load case."""
        return replace(self, solid=self.solid.single_case(case), d=self.require_data()[case : case + 1])

    def reads_nothing(self) -> bool:
        """Whether all probes are at clamped nodes."""
        bc, strains = self.solid.bc, self.strains
        nodes = self.probes.nodes if strains is None else np.concatenate([self.probes.nodes, strains.nodes])
        return not (bc.index[:, nodes] != bc.n_free).any()

    def misfit(self, u: Any, p: Any, xp: Any = np) -> Any:
        s = self.solid.setup(p, xp)
        d, U = self.require_data(), self._probe_displacements(u, s, xp)
        J = sum(0.5 * (self._residual(U[case], d[case]) ** 2).sum() for case in range(len(d)))
        return J if self.strains is None else J + 0.5 * (self._strain_residual(u, s, xp) ** 2).sum()

    def _strain_residual(self, u: Any, s: Setup, xp: Any = np) -> Any:
        assert self.strains is not None
        return self.strains.residual(self.solid.displacements(u, s, 0, self.strains.nodes, xp))

    def _residual(self, U: Any, d: Any) -> Any:
        """P w (S u - d), (m,), of one load case."""
        r = self.probes.residual(U, d)
        return r if self.motion is None else self.motion.projected(r)

    def moved(self, u: Array, p: Array) -> dict[str, float]:
        """The motion that is eliminated, by name."""
        if self.motion is None:
            return {}
        d, U = self.require_data(), self._probe_displacements(u, self.solid.setup(p))
        found = [self.motion.of_residual(self.probes.residual(U[case], d[case])) for case in range(len(d))]
        several = len(found) > 1
        return {f"{name}, case {k + 1}" if several else name: m for k, of in enumerate(found) for name, m in of.items()}

    def misfit_gradient(self, u: Array, p: Array) -> tuple[Array, Any]:
        """Derivatives of the misfit with respect to u (n_u,) and the grip displacement."""
        s, bc = self.solid.setup(p), self.solid.bc
        d, U = self.require_data(), self._probe_displacements(u, s)
        forces = [self.probes.forces(self._residual(U[case], d[case])) for case in range(len(d))]
        parts = [bc.assemble(f, self.probes.nodes, case) for case, f in enumerate(forces)]
        if self.strains is not None:
            by_u, by_a = bc.assemble(self.strains.forces(self._strain_residual(u, s)), self.strains.nodes, 0)
            parts = [(parts[0][0] + by_u, parts[0][1] + by_a)]
        return np.concatenate([by_u for by_u, _ in parts]), sum(by_a for _, by_a in parts)

    def observation(self, u: Array, p: Array) -> Observation:
        d, U = self.require_data(), self._probe_displacements(u, self.solid.setup(p))
        measured, cases = self.probes.measured, range(len(d))
        S_u, S_a = self._sampling_matrix
        predicted = np.concatenate([self.probes.read(U[case])[measured] for case in cases])
        data = np.concatenate([d[case][measured] for case in cases])
        S_p = S_a if self.solid.grip_is_parameter else None
        at = np.tile(self.probes.x[np.nonzero(measured)[0]], (len(d), 1))
        quantity = np.concatenate([self._quantities(case) for case in cases])
        seen = Observation(predicted, data, S_u, S_p, self.noise, self._label, position=at, quantity=quantity)
        if self.probes.weights is not None:
            seen = seen.weighted(np.tile(self.probes.weights[measured], len(d)))
        if self.strains is not None:
            seen = self._with_strains(seen, u, p)
        if self.motion is None:
            return seen
        strained = len(seen.data) - len(self.motion.Q) * len(d)
        return seen.without(self.motion.padded(strained) if strained else self.motion, len(d))

    def _with_strains(self, seen: Observation, u: Array, p: Array) -> Observation:
        """The rows of strains below those of displacements; one load case."""
        from scipy import sparse

        gauges, bc = self.strains, self.solid.bc
        assert gauges is not None
        w, measured = gauges.weight, gauges.measured
        S = w * gauges.matrix(bc.index[0], bc.n_free + 2)
        U = self.solid.displacements(u, self.solid.setup(p), 0, gauges.nodes)
        S_p = None if seen.S_p is None else np.concatenate([seen.S_p, S[:, [bc.n_free + 1]].toarray()])
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
        return [self.solid.displacements(u, s, case, self.probes.nodes, xp) for case in range(self._cases)]

    @cached_property
    def _sampling_matrix(self) -> tuple[Any, Array]:
        """The rows of S for u (m, n_u), sparse, and for the grip displacement (m, 1)."""
        from scipy import sparse

        bc, probes = self.solid.bc, self.probes
        points, components = np.nonzero(probes.measured)
        N, blocks, grips = probes.N[points], [], []
        for case in range(self._cases):
            at = bc.index[case][probes.nodes[points], components[:, None]]  # (m, k)
            rows = np.broadcast_to(np.arange(len(points))[:, None], at.shape)
            entries = (N.ravel(), (rows.ravel(), at.ravel()))
            S = sparse.csr_array(entries, shape=(len(points), bc.n_free + 2))
            blocks.append(S[:, : bc.n_free])
            grips.append(S[:, [bc.n_free + 1]].toarray())
        return sparse.block_diag(blocks, format="csr"), np.concatenate(grips)

    def _label(self, k: int) -> str:
        points, components = np.nonzero(self.probes.measured)
        case, k = divmod(k, len(points))
        return self._name(int(components[k]), self.probes.x[points[k]], case)

    def _quantities(self, case: int) -> Array:
        names = [f"u{axis}{self._of_case(case)}" for axis in AXES[: self.probes.x.shape[1]]]
        return np.array(names)[np.nonzero(self.probes.measured)[1]]

    def _of_case(self, case: int) -> str:
        return f", case {case + 1}" if self._cases > 1 else ""

    def _name(self, component: int, x: Array, case: int) -> str:
        return f"u_{AXES[component]} at ({', '.join(f'{x_i:.3g}' for x_i in x)}){self._of_case(case)}"
