"""What of a sweep is still to be done: a store's latest row of every case against what the case is now."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Literal

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.samples import Elapsed
from gradient_routes.bench.store.keeping import kept_apart
from gradient_routes.bench.store.merge import merge
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError

State = Literal["missing", "failed", "stale", "done"]
OPEN: tuple[State, ...] = ("missing", "failed", "stale")


def state_of(row: Row, kept: Row | None, expected: Callable[[Row], bool] = lambda row: False) -> State:
    """Of a case whose latest row is `kept`, None for none.

    A skipped case waits for a larger budget, a pruned one for the smaller case to be tried again. A bill is stale where
    it was priced on a busy machine, or where that is not known. One that failed as it was expected to is done.
    """
    if kept is None or kept["status"] == "pruned":
        return "missing"
    if kept["content_key"] != row["content_key"]:
        return "stale"
    if kept["status"] == "skipped":
        more = kept["budget_s"] is not None and (row["budget_s"] is None or row["budget_s"] > kept["budget_s"])
        return "missing" if more else "stale" if _doubtful(kept) else "done"
    return "done" if kept["status"] == "ok" or expected(kept) else "failed"


def _doubtful(skipped: Row) -> bool:
    """Whether a case was skipped for a bill whose price may be of a busy machine."""
    wall, cpu = skipped["price_s"], skipped["price_cpu_s"]
    return skipped["predicted_s"] is not None and (wall is None or cpu is None or Elapsed(wall, cpu).busy)


def still_open(store: Store, states: tuple[State, ...], expected: Callable[[Row], bool]) -> Callable[[Row], bool]:
    """Whether a case is in one of `states` and no other runner has tried it since: asked when its turn comes."""
    before = store.newest()

    def is_open(row: Row) -> bool:
        kept = store.latest(row["case_key"]).get(row["case_key"])
        if state_of(row, kept, expected) not in states:
            return False
        tried = kept is not None and kept["content_key"] == row["content_key"]
        return not (tried and store.newest(row["case_key"]) > before)

    def wanted(row: Row) -> bool:
        if not is_open(row) or any(_is_in(Store(path), row) for path in kept_apart(store)):
            return False
        return is_open(row)  # another runner may have added it to the store between the two

    return wanted


def _is_in(apart: Store, row: Row) -> bool:
    with suppress(InputError):  # it is being written, or has been added to the store since
        kept = apart.latest(row["case_key"]).get(row["case_key"])
        return kept is not None and kept["content_key"] == row["content_key"]
    return False


def add_kept_apart(store: Store) -> list[str]:
    """Add to a store what earlier runs could not, and delete their files; what to say of each."""
    said = []
    for path in kept_apart(store):
        try:
            cases, studies = merge(store, Store(path))
            path.unlink(missing_ok=True)
        except InputError as error:
            if path.exists() and path.stat().st_size:  # else another run writes it, or has added it
                said.append(f"{error}; cases in it count as done")
        else:
            said.append(f"{cases} cases and {studies} studies of {path} added to {store.path}")
    return said
