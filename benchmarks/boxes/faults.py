"""Mistakes that can be made in any gradient."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.boxes.box import Faulty, Model
from gradient_routes.problems.problem import Array

SHARE = 0.05  # of the largest |g_i w_i|: a component above it matters in every random direction


def natural(model: Model) -> Array:
    """The natural changes w (n_p,) that `check` assumes."""
    size = np.abs(model.p)
    default = np.where(size > 0, size, np.median(size[size > 0]) if size.any() else 1.0)
    return np.maximum(size, model.options.get("scale", default))


def weighty(model: Model, rng: np.random.Generator) -> int:
    """A component that matters."""
    share = np.abs(model.g(model.p) * natural(model))
    return int(rng.choice(np.flatnonzero(share >= SHARE * share.max())))


def scaled(model: Model, factor: float, name: str) -> Faulty:
    """All of it off by a factor."""
    return Faulty(name, lambda p: factor * model.g(p))


def one_scaled(model: Model, i: int, factor: float, name: str) -> Faulty:
    """One component off by a factor."""

    def g(p: Array) -> Array:
        out = np.array(model.g(p), dtype=float)
        out[i] *= factor
        return out

    return Faulty(name, g, frozenset({i}))


def sign(model: Model, rng: np.random.Generator) -> Faulty:
    return scaled(model, -1.0, "sign")


def zero(model: Model, rng: np.random.Generator) -> Faulty:
    return scaled(model, 0.0, "zero")


def factor(model: Model, rng: np.random.Generator) -> Faulty:
    return scaled(model, float(rng.choice([0.5, 0.9, 1.1, 2.0, 3.0, 10.0])), "factor")


def component(model: Model, rng: np.random.Generator) -> Faulty:
    return one_scaled(model, weighty(model, rng), float(rng.choice([-1.0, 0.5, 1.5, 2.0])), "component")


def dropped(model: Model, rng: np.random.Generator) -> Faulty:
    return one_scaled(model, weighty(model, rng), 0.0, "dropped")


def offset(model: Model, rng: np.random.Generator) -> Faulty:
    """A constant is added to every component, in natural changes."""
    w = natural(model)
    c = rng.uniform(0.1, 0.5) * np.linalg.norm(model.g(model.p) * w) / np.sqrt(len(w)) / w
    return Faulty("offset", lambda p: model.g(p) + c)


def permuted(model: Model, rng: np.random.Generator) -> Faulty:
    """Two components changed places; the one that matters, and the one most unlike it."""
    i, g_0, w = weighty(model, rng), model.g(model.p), natural(model)
    j = int(np.argmax(np.abs(g_0 - g_0[i]) * np.minimum(w, w[i])))

    def g(p: Array) -> Array:
        out = np.array(model.g(p), dtype=float)
        out[[i, j]] = out[[j, i]]
        return out

    return Faulty("permuted", g, frozenset({i, j}))


Fault = Callable[[Model, np.random.Generator], Faulty]
LOCAL: tuple[Fault, ...] = (component, dropped)
MORE: tuple[Fault, ...] = (factor, offset, component, dropped, permuted)


def some(model: Model, rng: np.random.Generator, count: int, among: tuple[Fault, ...] = MORE) -> Iterator[Faulty]:
    """So many different faults; where all components are alike, no permutation shows."""
    g = model.g(model.p) * natural(model)
    alike = float(np.ptp(g)) < 0.1 * float(np.abs(g).max())
    shown = [fault for fault in among if not (fault is permuted and alike)]
    for k in rng.permutation(len(shown))[:count]:
        yield shown[int(k)](model, rng)
