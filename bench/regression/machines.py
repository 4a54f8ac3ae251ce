"""Differences of the machines and libraries of two cases: times of different machines are not compared."""

from __future__ import annotations

from typing import Any

from gradient_routes.bench.regression.measured import Case
from gradient_routes.bench.render.format import bytes_

MACHINE = ("cpu", "cores", "usable_cores", "memory_bytes", "os", "threads")
LIBRARIES = ("python", "blas")


def machine_differences(base: Case, new: Case) -> list[str]:
    """Differences of machine and threads: `cores 2 there, 8 here`."""
    if base.environment == new.environment and base.row["threads"] == new.row["threads"]:
        return []
    pairs = {name: (base.environment.get(name), new.environment.get(name)) for name in MACHINE}
    pairs["threads of the case"] = (base.row["threads"], new.row["threads"])
    return _differences(pairs)


def library_differences(base: Case, new: Case) -> list[str]:
    """Differences of versions."""
    if base.environment == new.environment:
        return []
    pairs = {name: (base.environment.get(name), new.environment.get(name)) for name in LIBRARIES}
    before, now = (case.environment.get("versions") or {} for case in (base, new))
    pairs |= {name: (before.get(name), now.get(name)) for name in sorted(before.keys() | now.keys())}
    return _differences(pairs)


def _differences(pairs: dict[str, tuple[Any, Any]]) -> list[str]:
    return [f"{name} {_shown(name, a)} there, {_shown(name, b)} here" for name, (a, b) in pairs.items() if a != b]


def _shown(name: str, value: Any) -> str:
    if value in (None, {}):
        return "unset" if "threads" in name else "unknown"
    if name == "memory_bytes":
        return bytes_(value)
    if isinstance(value, dict):
        return " ".join(f"{key}={item}" for key, item in value.items())
    return f"{value:g}" if isinstance(value, float) else str(value)
