"""How large problems are, and which cannot be built as asked: known before anything is measured."""

from __future__ import annotations

from bench.case import ProblemSpec, sized
from bench.executors.isolated import Line
from bench.foreign_output import stdout_to_stderr
from bench.isolation.limits import Limits
from bench.isolation.process import Killed
from bench.outcome import FOREIGN, bare
from bench.pruning import Size
from bench.workbench import Settings
from bench.worker import Survey
from problems.errors import DomainError, InputError, RoutesError


def sizes(problems: list[ProblemSpec], settings: Settings, limits: Limits | None) -> list[Size | None]:
    """n_u and n_p of every problem, in a process of its own under `limits` or, where None, in this one; None for one
    whose code fails: each of its cases will tell. Raises InputError, DomainError.
    """
    if limits is None:
        return [_understood(surveyed(problem, settings.at)) for problem in problems]
    found: list[Size | None] = []
    while len(found) < len(problems):
        line = Line(Survey(problems[len(found) :], settings), limits)
        try:
            while len(found) < len(problems):
                found.append(_understood(line.hear()[1]))
        except (EOFError, Killed):
            found.append(None)  # the one that it ended at
        finally:
            line.close()
    return found


def surveyed(problem: ProblemSpec, at: str) -> Size | RoutesError | None:
    """The size of one problem, the error of one that refuses what it is given, None for one that fails."""
    try:
        with stdout_to_stderr():
            return sized(problem, at)
    except (InputError, DomainError) as error:
        return bare(error)
    except FOREIGN:
        return None


def _understood(what: Size | RoutesError | None) -> Size | None:
    if isinstance(what, RoutesError):
        raise what
    return what
