"""The files a run writes beside the store: refused before anything is measured, written when all is."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.cases.partial import Partial
from gradient_routes.bench.store.output_files import check_writable
from gradient_routes.problems.errors import InputError


@dataclass(frozen=True)
class Files:
    """Where --gradient and --vtu write, if anywhere."""

    gradient: Path | None = None
    vtu: Path | None = None

    def check(self, cases: int, partial: Partial | None, taken: Iterable[Path]) -> None:
        """Raise InputError for what cannot be written, for files in `taken`, for fields of anything but one case."""
        if self.vtu is not None and cases != 1:
            raise InputError(f"--vtu {self.vtu}: holds one problem and one route, these are {cases} cases - name one")
        if self.vtu is not None and partial is not None:
            raise InputError(f"--vtu {self.vtu}: needs the whole gradient - drop --{partial.kind}")
        taken = list(taken)
        for option, path in (("--gradient", self.gradient), ("--vtu", self.vtu)):
            if path is not None:
                check_writable(option, path, taken)
                taken.append(path)

    def write(self, outcomes: Sequence[Outcome]) -> tuple[list[str], list[str]]:
        """Write what was measured. Sentences for what was written or why it was not, and for what went wrong."""
        said: list[str] = []
        failed: list[str] = []
        for option, path, write in (("--gradient", self.gradient, _gradients), ("--vtu", self.vtu, _fields)):
            if path is None or not outcomes:
                continue
            try:
                said.append(write(path, outcomes))
            except InputError as error:
                failed.append(str(error))
            except OSError as error:
                failed.append(f"{option} {path}: {error.strerror or error} - name a file you may write")
        return said, failed


def _gradients(path: Path, outcomes: Sequence[Outcome]) -> str:
    from gradient_routes.bench.studies.bill import gradient_csv

    views = [(o.row, o.view) for o in outcomes if o.view is not None]
    gradient_csv.write(path, views)
    return f"gradients of {len(views)} of {len(outcomes)} cases in {path}"


def _fields(path: Path, outcomes: Sequence[Outcome]) -> str:
    from gradient_routes.bench.studies.bill import vtu

    (outcome,) = outcomes
    if outcome.fields is None:
        status = "gave no fields" if outcome.row["status"] == "ok" else outcome.row["status"]
        return f"nothing written to {path}: {outcome.row['route']} on {outcome.row['problem']} {status}"
    vtu.write(path, outcome.fields)
    return f"fields in {path}"
