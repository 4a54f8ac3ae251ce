"""Arrays inside nested objects, by the paths that Tesseract gives them: `load`, `parts.[0].E`, `by.{name}`."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array

Key = str | int
SPECIAL = "{}\\"  # escaped in names of a dictionary


@dataclass(frozen=True)
class Leaf:
    """An array, its path and the keys that lead to it."""

    path: str
    keys: Sequence[Key]
    value: Array

    def components(self) -> Iterator[str]:
        """Names, counted from 1: E_3, A_1_2."""
        for index in np.ndindex(self.value.shape):
            yield "_".join((self.path, *(str(i + 1) for i in index)))


def leaves(pattern: str, tree: Any, path: str = "", keys: tuple[Key, ...] = ()) -> Iterator[Leaf]:
    """Those of a pattern as parts.[].E or by.{}, as float64; none where an optional one is left out.

    Raises TypeError or ValueError for what is no array of numbers.
    """
    if not pattern:
        if tree is not None:
            yield Leaf(path, keys, np.asarray(tree, np.float64))
        return
    head, _, rest = pattern.partition(".")
    found: Iterable[tuple[str, Key, Any]] = ()
    if head == "[]" and isinstance(tree, list | tuple):
        found = ((f"[{i}]", i, value) for i, value in enumerate(tree))
    elif head == "{}" and isinstance(tree, dict):
        found = ((f"{{{_escaped(key)}}}", key, value) for key, value in tree.items())
    elif isinstance(tree, dict) and head in tree:
        found = ((head, head, tree[head]),)
    for name, key, value in found:
        yield from leaves(rest, value, f"{path}.{name}".lstrip("."), (*keys, key))


def replaced(tree: Any, values: Iterable[tuple[Sequence[Key], Array]]) -> Any:
    """The tree itself, with other arrays."""
    for (*above, last), value in values:
        at = tree
        for key in above:
            at = at[key]
        at[last] = value
    return tree


def decoded(tree: Any) -> Any:
    """With arrays in place of {"object_type": "array", ...}. Raises KeyError, TypeError or ValueError."""
    if isinstance(tree, dict) and tree.get("object_type") == "array":
        data, dtype = tree["data"], np.dtype(tree["dtype"])
        if data["encoding"] == "base64" and not data.get("compression"):
            return np.frombuffer(base64.b64decode(data["buffer"], validate=True), dtype).reshape(tree["shape"])
        if data["encoding"] == "json":
            return np.array(data["buffer"], dtype).reshape(tree["shape"])
        raise ValueError(f"encoding {data['encoding']}: give json or base64")
    if isinstance(tree, dict):
        return {key: decoded(value) for key, value in tree.items()}
    return [decoded(value) for value in tree] if isinstance(tree, list) else tree


def _escaped(key: str) -> str:
    return "".join(f"\\{c}" if c in SPECIAL else c for c in key)
