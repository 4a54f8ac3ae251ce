"""Loads that go to zero: every row that is called ok is right, and those of sound problems are called ok."""

from __future__ import annotations

import pytest

from benchmarks.loads import ROUTES, Kind, judged, kinds

KINDS = {kind.name: kind for kind in kinds()}
CHEAP = [name for name in KINDS if not name.startswith(("block", "plate"))] + [
    "block[n=2,law=mooney-rivlin,derivatives=hand]"
]


@pytest.mark.parametrize("kind", [KINDS[name] for name in CHEAP], ids=CHEAP)
def test_no_gradient_that_is_wrong_is_called_ok(kind: Kind) -> None:
    """The other laws and the decades between: python -m benchmarks.loads; test_routes has loads of 1."""
    records = list(judged(kind, (1e-8, 1e-16)))
    assert [record["route"] for record in records] == 2 * list(ROUTES)
    assert [record for record in records if record["wrong"]] == []
    assert [(r["load"], r["route"], r["reason"]) for r in records if r["status"] != "ok"] == []
