"""Answers, bills and changes in words, and an advice as plain objects."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from gradient_routes.bench.advice.advise import Advice
from gradient_routes.bench.advice.answers import Answers
from gradient_routes.bench.advice.bill import Bill
from gradient_routes.bench.advice.changes import Change
from gradient_routes.bench.advice.statements import Statement
from gradient_routes.bench.units import duration, size
from gradient_routes.problems.problem import OFFERED_AS, offer_names

COUNTED = {
    "n_p": "parameter",
    "outputs": "output",
    "newton": "Newton step",
    "steps": "step in time",
    "gradients": "gradient",
}
YES = {
    ("smooth", False): "kinks of J near p",
    ("smooth", True): "no kinks of J near p",
    ("iterate", True): "the derivative of the iterate wanted",
    ("iterate", False): "the derivative of the solution wanted",
}


def count(n: int, name: str) -> str:
    """`1 step in time`, `2 steps in time`."""
    noun, in_time, _ = name.partition(" in time")
    return f"{n} {noun}{'' if n == 1 else 's'}{in_time}"


def described(answers: Answers) -> str:
    """The answers that a bill depends on, in one line."""
    known = answers.measured
    one = "one objective" if answers.outputs == 1 else f"the Jacobian of {answers.outputs} data"
    unknowns = count(answers.n_u, "unknown")
    if answers.steps:
        unknowns += f" in each of {count(answers.steps, COUNTED['steps'])}"
    solves = "linear" if answers.linear else count(answers.newton, COUNTED["newton"])
    parts = [
        one,
        count(answers.n_p, COUNTED["n_p"]),
        unknowns,
        solves,
        f"a forward solve {duration(answers.forward_s)}",
    ]
    return (f"{known.name}: " if known else "") + ", ".join(parts)


def said(change: Change) -> str:
    """The condition of a change, to be read after `with`."""
    value, bound = change.value, change.bound
    match change.answer:
        case "offers":
            return f"{bound} {OFFERED_AS[value]}"
        case "smooth" | "iterate":
            return f"with {YES[change.answer, value]}"
        case "memory":
            return f"with {bound} {size(value)} of memory"
        case "budget":
            return f"with {bound} {duration(value)} for all gradients"
        case "rtol":
            return f"with solves that leave {bound} {value:g}"
        case "error":
            return f"with an error of {bound} {value:g} allowed"
        case name:
            return f"with {bound} {count(value, COUNTED[name])}"


def plain(advice: Advice) -> dict[str, Any]:
    """For JSON: numbers, texts, lists and objects; what has no limit is None."""
    answers = {name: value for name, value in vars(advice.answers).items() if name not in ("measured", "offers")}
    return {
        "answers": answers | {"offers": offer_names(advice.answers.offers)},
        "recommended": None if advice.best is None else advice.best.selector,
        "routes": [_bill(bill, advice) for bill in advice.ranked],
        "reasons": [asdict(reason) for reason in advice.reasons],
        "changes": [
            {"answer": change.answer, "bound": change.bound, "value": _value(change), "says": said(change)}
            | {"route": change.best.selector, "seconds": change.best.seconds}
            for change in advice.changes
        ],
    }


def _bill(bill: Bill, advice: Advice) -> dict[str, Any]:
    possible = bill.objection is None or math.isfinite(bill.seconds)
    return {
        "route": bill.selector,
        "possible": bill.objection is None,
        "reason": bill.objection,
        "work": asdict(bill.work) if possible else None,
        "seconds": bill.seconds,
        "forward_ratio": advice.costs(bill),
        "held_bytes": bill.memory,
        "error": bill.error,
    }


def _value(change: Change) -> Any:
    return offer_names(change.value) if change.answer == "offers" else change.value


def cited(statement: Statement) -> str:
    """A statement with its sources and its page of docs/."""
    return f"{statement.text} [{'; '.join([*statement.sources, f'docs/{statement.page}'])}]"
