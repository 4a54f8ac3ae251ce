"""What can go wrong, in one line each: `<who>: <what happened, with numbers> - <what to do>`."""

from __future__ import annotations


class RoutesError(Exception):
    """Base of every error this project raises on purpose; its text is one line for the user."""


class InputError(RoutesError):
    """What the user gave (an option, a file, a name) cannot be used; nothing was computed."""


class DomainError(RoutesError):
    """A parameter, or a finite-difference step from it, lies outside the parameter's domain."""


class NotOffered(RoutesError):
    """A route asked a problem for something it does not offer."""


class SingularMatrix(RoutesError):
    """A matrix that had to be factorized is singular, or not positive definite although it should be."""


class Overflow(RoutesError):
    """A number left float64's range on the way."""


class NotConverged(RoutesError):
    """The forward solve did not reach its tolerance.

    `history` holds the residual norms of all iterations, so that the failure can be judged.
    """

    def __init__(self, message: str, history: tuple[float, ...]) -> None:
        super().__init__(message)
        self.history = history
