"""Loads that go to zero: every row that is called ok is right, and those of sound problems are called ok."""

from __future__ import annotations

import pytest

from benchmarks.loads import ROUTES, judged, kinds

KINDS = {kind.name: kind for kind in kinds()}
CHEAP = [name for name in KINDS if not name.startswith(("block", "plate"))] + [
    "block[n=2,law=mooney-rivlin,derivatives=hand]"
]


@pytest.mark.parametrize("name", CHEAP)
def test_no_gradient_that_is_wrong_is_called_ok(name: str) -> None:
    """Every pair of a problem, a route and a load; all together, the other laws and the decades between: python -m
    benchmarks.loads; test_routes has loads of 1.
    """
    some = ROUTES[::2], ROUTES[1::2]
    for load, routes in zip((1e-8, 1e-16), some if CHEAP.index(name) % 2 else some[::-1], strict=True):
        records = list(judged(KINDS[name], (load,), routes))
        assert [record["route"] for record in records] == list(routes)
        assert [record for record in records if record["wrong"]] == []
        assert [(r["load"], r["route"], r["reason"]) for r in records if r["status"] != "ok"] == []
