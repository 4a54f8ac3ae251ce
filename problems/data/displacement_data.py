"""Displacements of a loaded body, read at probes in every load case, beside what was measured there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.probes import Probes
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.mechanics.design_variables import Setting
from gradient_routes.problems.mechanics.loaded_solid import Mechanics
from gradient_routes.problems.problem import Array


@dataclass(frozen=True, eq=False)
class DisplacementData:
    """S and d of J = 1/2 sum over load cases of |S u - d|^2 [m^2].

    d (cases, m, 3)  [m], None for a twin whose state is still to be solved for
    noise            standard deviation of the noise on d [m]
    """

    mechanics: Mechanics
    probes: Probes
    d: Array | None
    noise: float = 0.0

    def given(self) -> Array:
        """d. Raises InputError where a twin is not made yet."""
        if self.d is None:
            raise InputError(
                "block: data=twin are not made yet - solve for them:"
                " gradient_routes.routes.synthetic_data.with_synthetic_data(block)"
            )
        return self.d

    def blank(self) -> DisplacementData:
        """With zeros to measure against: the twin that is to be solved for."""
        return replace(self, d=np.zeros((self._cases, *self.probes.x.shape)))

    def made(self, u: Array, s: Setting, rng: np.random.Generator) -> DisplacementData:
        """Read off a state u, with noise."""
        d = np.stack([self.probes.read(U) for U in self._seen(u, s)])
        return replace(self, d=d + self.noise * rng.standard_normal(d.shape))

    def alone(self, case: int) -> DisplacementData:
        """Of one load case."""
        return replace(self, mechanics=self.mechanics.alone(case), d=self.given()[case : case + 1])

    def reads_nothing(self) -> bool:
        """Whether all probes sit where displacements are held at zero."""
        supports = self.mechanics.supports
        return not (supports.index[:, self.probes.nodes] != supports.n_free).any()

    def misfit(self, u: Any, p: Any, xp: Any = np) -> Any:
        d, U = self.given(), self._seen(u, self.mechanics.setting(p, xp), xp)
        return sum(self.probes.misfit(U[case], d[case]) for case in range(len(d)))

    def misfit_gradient(self, u: Array, p: Array) -> tuple[Array, Any]:
        """Its derivative by u (n_u,), and by the amplitude of a grip."""
        d, U = self.given(), self._seen(u, self.mechanics.setting(p))
        forces = [self.probes.misfit_gradient(U[case], d[case]) for case in range(len(d))]
        parts = [self.mechanics.supports.gather(f, self.probes.nodes, case) for case, f in enumerate(forces)]
        return np.concatenate([by_u for by_u, _ in parts]), sum(by_a for _, by_a in parts)

    def observation(self, u: Array, p: Array) -> Observation:
        d, U = self.given(), self._seen(u, self.mechanics.setting(p))
        seen, cases = self.probes.seen, range(len(d))
        S_u, S_a = self._sampling
        return Observation(
            np.concatenate([self.probes.read(U[case])[seen] for case in cases]),
            np.concatenate([d[case][seen] for case in cases]),
            S_u,
            S_a if self.mechanics.moves_grip else None,
            self.noise,
            self._datum,
        )

    def candidates(self) -> Candidates:
        """Every free displacement component of every node, in every load case."""
        supports, X = self.mechanics.supports, self.mechanics.body.geometry.X
        case, node, component = np.nonzero(supports.index < supports.n_free)
        at = case * supports.n_free + supports.index[case, node, component]
        return Candidates(at, lambda j: self._reading(int(component[j]), X[node[j]], int(case[j])), X[node])

    @property
    def _cases(self) -> int:
        return len(self.mechanics.directions)

    def _seen(self, u: Any, s: Setting, xp: Any = np) -> list[Any]:
        """Displacements of the nodes the probes read, (m, k, 3) each load case."""
        return [self.mechanics.displacements(u, s, case, self.probes.nodes, xp) for case in range(self._cases)]

    @cached_property
    def _sampling(self) -> tuple[Any, Array]:
        """S datum by datum: of u (m, n_u), sparse, and of the amplitude of a grip (m, 1)."""
        from scipy import sparse

        supports, probes = self.mechanics.supports, self.probes
        points, components = np.nonzero(probes.seen)
        N, blocks, grips = probes.N[points], [], []
        for case in range(self._cases):
            at = supports.index[case][probes.nodes[points], components[:, None]]  # (m, k)
            rows = np.broadcast_to(np.arange(len(points))[:, None], at.shape)
            entries = (N.ravel(), (rows.ravel(), at.ravel()))
            S = sparse.csr_array(entries, shape=(len(points), supports.n_free + 2))
            blocks.append(S[:, : supports.n_free])
            grips.append(S[:, [supports.n_free + 1]].toarray())
        return sparse.block_diag(blocks, format="csr"), np.concatenate(grips)

    def _datum(self, k: int) -> str:
        points, components = np.nonzero(self.probes.seen)
        case, k = divmod(k, len(points))
        return self._reading(int(components[k]), self.probes.x[points[k]], case)

    def _reading(self, component: int, x: Array, case: int) -> str:
        which = f", case {case + 1}" if self._cases > 1 else ""
        return f"u_{'xyz'[component]} at ({', '.join(f'{x_i:.3g}' for x_i in x)}){which}"
