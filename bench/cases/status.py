"""How a case or a study ends, and what an exception of somebody's code makes of it."""

from __future__ import annotations

from enum import StrEnum

from gradient_routes.problems.errors import Crashed, NotConverged, RoutesError
from gradient_routes.problems.text import shortened

FOREIGN = (Exception, SystemExit, GeneratorExit)  # what the code of a plug-in may raise
EXHAUSTED = ("RESOURCE_EXHAUSTED", "out of memory", "not enough memory")  # what XLA and PARDISO say for MemoryError


class Status(StrEnum):
    """An outcome: the text that rows hold, what it means, and what to do about it where its reason does not say."""

    meaning: str
    todo: str

    def __new__(cls, text: str, meaning: str, todo: str = "") -> Status:
        member = str.__new__(cls, text)
        member._value_, member.meaning, member.todo = text, meaning, todo
        return member

    OK = "ok", "it gave numbers"
    SKIPPED = "skipped", "predicted to cost more than the budget, or it does not apply"
    PRUNED = "pruned", "not tried: a smaller size met a limit"
    TIMEOUT = "timeout", "killed at its limit of wall time", "raise the limit, or ask for less"
    OUT_OF_MEMORY = "out-of-memory", "it needs more memory than it may use", "raise --memory, or ask for less"
    NOT_CONVERGED = "not-converged", "a solver did not reach its tolerance"
    OTHER_FUNCTIONAL = "other-functional", "another code's J is not ours: its gradient is of something else"
    NON_FINITE = "non-finite", "a result is NaN or infinite"
    FAILED = "failed", "it raised an exception"
    CRASHED = "crashed", "its process ended without a result", "see its output above"
    REFUSED = "refused", "its input is not valid"  # of a study; a case with invalid input has failed
    INTERRUPTED = "interrupted", "the user ended it"

    @property
    def exit_code(self) -> int:
        """Of a command that ends so."""
        return {"ok": 0, "refused": 2, "interrupted": 130}.get(self, 1)


class Failure(RoutesError):
    """A case that cannot give a valid number."""


class NonFinite(Failure):
    """A result that is NaN or infinite."""


def status_of(failure: BaseException) -> Status:
    """What an exception means. The only place that reads its text: XLA has no type for a lack of memory."""
    said = f"{failure} {failure.__cause__ or ''}"
    if isinstance(failure, MemoryError) or any(words in said for words in EXHAUSTED):
        return Status.OUT_OF_MEMORY
    if isinstance(failure, NotConverged):
        return Status.NOT_CONVERGED
    typed = {NonFinite: Status.NON_FINITE, Crashed: Status.CRASHED}
    return next((status for kind, status in typed.items() if isinstance(failure, kind)), Status.FAILED)


def one_line(error: BaseException) -> str:
    """Its type and its text."""
    said = " ".join(shortened(str(error)).split())
    return f"{type(error).__name__}: {said}" if said else type(error).__name__


def reason_of(failure: BaseException, who: str) -> str:
    """What happened, in a sentence; errors of this project are sentences."""
    return str(failure) if isinstance(failure, RoutesError) else f"{who}: {one_line(failure)} - see --debug"
