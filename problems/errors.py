"""Errors, each with a one-line message `<who>: <what happened, with numbers> - <what to do>`."""

from __future__ import annotations

from typing import Any


class RoutesError(Exception):
    """Base of the errors of this project; the message is one line for the user."""


class InputError(RoutesError):
    """Invalid input: an option, a file or a name. Nothing was computed."""


class Unsupported(InputError):
    """Another code does not know a case, or an option."""


class Crashed(RoutesError):
    """The process of another code ended without a result."""


class DomainError(RoutesError):
    """A parameter or a finite-difference step lies outside the domain of the parameter."""


class NotOffered(RoutesError):
    """A route asked a problem for something it does not offer."""


class LostImaginaryPart(RoutesError):
    """R or J of a problem that offers COMPLEX drops the imaginary part of its arguments."""


class LowPrecision(RoutesError):
    """An array of a problem has fewer digits than float64, or is no array of numbers."""


class SingularMatrix(RoutesError):
    """A matrix that had to be factorized is singular, or not positive definite although it should be."""


class Overflow(RoutesError):
    """A number exceeded the range of float64."""


class NotConverged(RoutesError):
    """The forward solve did not reach its tolerance.

    `history` holds the residual norms of all iterations.
    """

    def __init__(self, message: str, history: tuple[float, ...]) -> None:
        super().__init__(message)
        self.history = history


OUTSIDE = (DomainError, NotConverged, SingularMatrix, Overflow, FloatingPointError)  # of where J has a value


def check_applies(who: str, *rules: tuple[str, bool, bool, dict[str, Any]]) -> None:
    """Raises InputError for options that would be ignored.

    A rule is (condition, whether it holds, whether the options need it or exclude it, {option: whether given}).
    """
    for condition, holds, needed, options in rules:
        given = [name for name, value in options.items() if value]
        if given and holds != needed:
            verb, change = "needs" if needed else "does not go with", condition.partition("=")[0]
            raise InputError(f"{who}: {given[0]} {verb} {condition} - leave {given[0]} out or change {change}")
