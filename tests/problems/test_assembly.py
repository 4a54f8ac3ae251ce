"""Hand-derived assembly in NumPy against that of JAX: R, R_u, its products and R_p, real and complex."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from gradient_routes.problems.block import Block

RNG = np.random.default_rng(0)
VARIANTS = {
    "congruent": {},
    "mooney-rivlin": {"law": "mooney-rivlin", "unknown": "constants"},
    "not congruent": {"element": "tet10", "n": 1},
    "two cases": {"cases": 2, "unknown": "layers", "parametrization": "raw"},
    "grip": {"load": "displacement"},
    "follower": {"load": "follower"},
}
COMPLEX = ("congruent", "not congruent")  # test_materials has those of the laws, test_block_variants of a follower


@pytest.mark.parametrize("name", VARIANTS)
def test_by_hand_is_by_ad(name: str) -> None:
    hand, ad = (Block(**({"n": 2} | VARIANTS[name]), derivatives=by) for by in ("hand", "ad"))
    p = hand.parameters.start
    u, v = hand.initial(p) + 0.01 * RNG.standard_normal(hand.n_state), RNG.standard_normal(hand.n_state)
    for at in ((u, p), (u + 1e-3j * v, p + 1e-3j))[: 2 if name in COMPLEX else 1]:
        same(hand.residual(*at), ad.residual(*at))
        same(hand.tangent(*at) @ v, ad.tangent(*at) @ v)
    if hand.matrix_free:
        same(hand.tangent_operator(u, p) @ v, ad.tangent(u, p) @ v)
    by_hand, by_ad, q = hand.linearize(u, p).R_p, ad.linearize(u, p).R_p, RNG.standard_normal(len(p))
    same(by_hand @ q, by_ad @ q)
    same(by_hand.T @ v, by_ad.T @ v)


def same(a: np.ndarray, b: np.ndarray) -> None:
    """Both to rounding, of sums over at most 64 points."""
    assert np.abs(a - b).max() < 1e-14 * np.abs(b).max()


def test_a_gradient_by_hand_imports_no_jax() -> None:
    """Nor pandas: they take 160 and 62 MB."""
    solve = """
import sys
from gradient_routes.problems.block import Block
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
b = Block(n=1)
p = b.parameters.start
adjoint.prepare(Model(b), p)(p)
print({"jax", "pandas"} & {*sys.modules})
"""
    done = subprocess.run([sys.executable, "-c", solve], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
