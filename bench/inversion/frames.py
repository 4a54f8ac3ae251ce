"""Frames of readings, each of which a linear map takes to parameters."""

from __future__ import annotations

import csv
import time
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.inversion.linear_map import LinearMap
from gradient_routes.bench.store.output_files import Output
from gradient_routes.problems.data.csv import NumberFile
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

EXCESS = 2.0  # times the noise, above which it does not explain a frame
MANY = 0.1  # of the frames, above which these are no accidents


@dataclass(frozen=True, eq=False)
class Estimates:
    """p (F, n_p) of F frames; over_noise (F,): their |r| / (sigma sqrt(m)), None where no noise is known; seconds of
    the products that gave p.
    """

    of: LinearMap
    p: Array
    over_noise: Array | None
    seconds: float

    @property
    def described(self) -> str:
        count = len(self.p)
        said = f"{count} frames, {self.seconds / count * 1e6:.2g} us each"
        if self.over_noise is None:
            return said
        said += f"; misfit / noise {np.median(self.over_noise):.3g} in the median"
        beyond = np.flatnonzero(self.over_noise > EXCESS)
        return said + (
            f"; misfit exceeds noise in {len(beyond)}, first in frame {beyond[0] + 1}" if beyond.size else ""
        )

    @property
    def unexplained(self) -> bool:
        """Whether noise does not explain many of them."""
        return self.over_noise is not None and float(np.mean(self.over_noise > EXCESS)) > MANY

    def write(self, output: Output) -> None:
        """A row a frame: its number, its misfit over noise where that is known, p. Raises RoutesError."""
        noise = [] if self.over_noise is None else ["misfit_over_noise"]
        columns = self.p if self.over_noise is None else np.column_stack([self.over_noise, self.p])
        with output.text() as file:
            out = csv.writer(file, lineterminator="\n")
            out.writerow(["frame", *noise, *self.of.names.tolist()])
            out.writerows([k, *row] for k, row in enumerate(columns.tolist(), start=1))


def estimated(by: LinearMap, frames: Array) -> Estimates:
    """By one product for all frames (F, m)."""
    begun = time.perf_counter()
    p = by(frames)
    seconds = time.perf_counter() - begun
    if not by.sigma:
        return Estimates(by, p, None, seconds)
    r = by.residual(frames, p)
    freedom = max(1, r.shape[1] - by.modes.shape[1])
    return Estimates(by, p, np.sqrt(np.sum(r**2, axis=1) / freedom) / float(by.sigma), seconds)


def read_frames(path: Path, by: LinearMap) -> tuple[Array, str | None]:
    """(F, m) of a file with a row a frame, CSV with columns named as the readings, in any order, or .npz with one array
    in their order; and what to say of the latter.

    Raises InputError, naming the column, the line or the frame.
    """
    named = path.suffix.lower() != ".npz"
    frames = _from_csv(path, by.readings.tolist()) if named else _from_npz(path)
    if frames.ndim != 2 or frames.shape[1] != len(by.readings) or not len(frames):
        raise InputError(f"--frames {path}: an array {frames.shape} - give (frames, {len(by.readings)} readings)")
    bad = np.flatnonzero(~np.isfinite(frames).all(axis=1))
    if bad.size:
        k = int(np.flatnonzero(~np.isfinite(frames[bad[0]]))[0])
        raise InputError(f"--frames {path}: frame {bad[0] + 1}, reading {by.readings[k]} is not finite - remove it")
    order = f"{by.readings[0]} to {by.readings[-1]}"
    return frames, None if named else f"--frames {path} names no columns: taken in the order of the readings, {order}"


def _from_csv(path: Path, readings: list[str]) -> Array:
    file = NumberFile.opened(path, located(""))
    if list(file.names) != readings:
        _check_names(path, file.names, readings)
    places = range(len(readings)) if list(file.names) == readings else [file.names.index(name) for name in readings]
    values, _ = file.read(list(places))
    return np.ascontiguousarray(values.T)


def _check_names(path: Path, columns: Sequence[str], readings: list[str]) -> None:
    """Raises InputError unless each reading has one column of its name."""
    remedy = "give one column a reading, named like it, or .npz without names in the order of the readings"
    twice = next((name for name in readings if readings.count(name) > 1), None)
    if twice is not None:
        raise InputError(
            f"--frames {path}: several readings are {twice}, and columns are not theirs in order - {remedy}"
        )
    wrong = next((name for name in readings if columns.count(name) != 1), None)
    if wrong is None:
        return
    k = readings.index(wrong) + 1
    other = next((name for name in columns if name not in readings), None)
    has = f"the first of other names is {other}" if other is not None else f"{columns.count(wrong)} columns have it"
    raise InputError(f"--frames {path}: reading {k} of {len(readings)} is {wrong}, {has} - {remedy}")


def _from_npz(path: Path) -> Array:
    try:
        with np.load(located(path), allow_pickle=False) as file:
            if len(file.files) != 1:
                raise InputError(f"--frames {path}: holds {len(file.files)} arrays - save one, (frames, readings)")
            found = file[file.files[0]]
            if found.dtype.kind not in "iuf":
                raise TypeError(found.dtype)
            return np.asarray(found, dtype=float)
    except OSError as error:
        raise InputError(f"--frames {path}: cannot be read: {error.strerror or error} - check the path") from error
    except (ValueError, TypeError, AttributeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise InputError(f"--frames {path}: holds no array of numbers - save (frames, readings) as .npz") from error
