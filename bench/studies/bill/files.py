"""The files a run writes beside the store: checked before anything is measured, written at the end."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gradient_routes.bench.cases.case import RouteSpec
from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.cases.partial import Partial
from gradient_routes.bench.store.output_files import Output
from gradient_routes.problems.errors import InputError, RoutesError

SUFFIXES = (".csv", ".npz", ".vtu")  # of sensitivities
COLUMNS_OF = "tangent"  # the route whose linearized states the columns are


@dataclass(frozen=True)
class Files:
    """Where --gradient, --vtu and --sensitivities write, if anywhere."""

    gradient: Path | None = None
    vtu: Path | None = None
    sensitivities: Path | None = None

    @property
    def fields(self) -> bool:
        """Whether one of the files holds fields on the mesh."""
        return self.vtu is not None or (self.sensitivities is not None and self.sensitivities.suffix == ".vtu")

    def check(self, problems: int, routes: Sequence[RouteSpec], partial: Partial | None, taken: Iterable[Path]) -> None:
        """Raise InputError for what cannot be written, for files in `taken`, for fields of anything but one case."""
        cases, taken = problems * len(routes), [*taken]
        for option, path in (("--vtu", self.vtu), ("--sensitivities", self.sensitivities)):
            if path is None:
                continue
            if cases != 1:
                raise InputError(
                    f"{option} {path}: holds one problem and one route, these are {cases} cases - name one"
                )
            if partial is not None:
                raise InputError(f"{option} {path}: needs the whole gradient - drop --{partial.kind}")
        if self.sensitivities is not None and routes[0].name != COLUMNS_OF:
            raise InputError(
                f"--sensitivities {self.sensitivities}: {routes[0].name} has no du/dp - give --route {COLUMNS_OF}"
            )
        for output, _ in self._all:
            output.check(taken)
            taken.append(output.path)

    @property
    def _all(self) -> list[tuple[Output, Callable[[Output, Sequence[Outcome]], str]]]:
        every = (
            ("--gradient", self.gradient, (".csv",), _gradients),
            ("--vtu", self.vtu, (".vtu",), _fields),
            ("--sensitivities", self.sensitivities, SUFFIXES, _sensitivities),
        )
        return [(Output(option, path, kind), write) for option, path, kind, write in every if path is not None]

    def write(self, outcomes: Sequence[Outcome]) -> tuple[list[str], list[str]]:
        """Write what was measured. Sentences for what was written or why it was not, and for what went wrong."""
        said: list[str] = []
        failed: list[str] = []
        for output, write in self._all if outcomes else ():
            try:
                said.append(write(output, outcomes))
            except RoutesError as error:
                failed.append(str(error))
        return said, failed


def _gradients(output: Output, outcomes: Sequence[Outcome]) -> str:
    from gradient_routes.bench.studies.bill import gradient_csv

    views = [(o.row, o.view) for o in outcomes if o.view is not None]
    gradient_csv.write(output, views)
    return f"gradients of {len(views)} of {len(outcomes)} cases in {output.path}"


def _fields(output: Output, outcomes: Sequence[Outcome]) -> str:
    from gradient_routes.bench.studies.bill import vtu

    (outcome,) = outcomes
    if outcome.fields is None:
        return _nothing(output.path, outcome, "fields")
    vtu.write(output, outcome.fields)
    return f"fields in {output.path}"


def _sensitivities(output: Output, outcomes: Sequence[Outcome]) -> str:
    from gradient_routes.bench.studies.bill import sensitivity_files

    if output.path.suffix == ".vtu":
        return _fields(output, outcomes)
    (outcome,) = outcomes
    if outcome.sensitivities is None:
        return _nothing(output.path, outcome, "sensitivities")
    sensitivity_files.write(output, outcome.sensitivities)
    rows, columns = outcome.sensitivities.values.shape
    return f"sensitivities, {rows} rows and {columns} columns, in {output.path}"


def _nothing(path: Path, outcome: Outcome, what: str) -> str:
    status = f"gave no {what}" if outcome.row["status"] == "ok" else outcome.row["status"]
    return f"nothing written to {path}: {outcome.row['route']} on {outcome.row['problem']} {status}"
