"""A verdict, or a contract, for the terminal and as JSON."""

from __future__ import annotations

from typing import Any

from rich.console import Console

from gradient_routes.bench.verification.contract import Contract
from gradient_routes.bench.verification.result import Check, rows
from gradient_routes.bench.verification.view import show_check, show_contract


def show(out: Console, found: Check | Contract, plots: bool = True) -> None:
    if isinstance(found, Contract):
        show_contract(out, found)
    else:
        show_check(out, found, curves=plots)


def as_dict(found: Check | Contract) -> dict[str, Any]:
    """What --json prints."""
    if isinstance(found, Contract):
        return {"name": found.name, "findings": [vars(f) | {"sound": f.sound} for f in found.findings]}
    return found.as_dict() | {"points": rows(found, {})["points"]}
