"""Measured tables: columns by what they measure, whatever their headers and units, in SI."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gradient_routes.problems.data.csv import NumberFile
from gradient_routes.problems.data.headers import Column, check_known, match, pairs
from gradient_routes.problems.data.units import PIXEL, Kind, factor, kind_of, quantity, zero
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

SENTINEL = 99.0  # least size of a number that marks missing values
APART = 10.0  # ratio of such a number to the greatest measured one
NINES = (999.0, 9999.0, 99999.0, 999999.0)


@dataclass(frozen=True)
class Group:
    """Columns of one quantity, under the names that a problem knows them by.

    need   whether all of them must be there, any, or none
    gaps   whether a cell may be empty; it is read as NaN
    marked whether numbers such as -999 among them are taken for marks of missing values
    others quantities that they are instead where their unit says so
    """

    names: tuple[str, ...]
    kind: Kind
    need: str = "all"
    gaps: bool = False
    marked: bool = True
    others: tuple[Kind, ...] = ()


@dataclass(frozen=True)
class Table:
    """What was read of a file.

    columns   name -> (n_rows,) in SI, or words
    lines     (n_rows,), of the file
    said      how units and columns were read, for a note; empty if numbers and names were taken as they are
    units     name -> unit, of columns that have one
    """

    path: str | Path
    columns: Mapping[str, Array]
    lines: Array
    said: str
    units: Mapping[str, str]

    def stack(self, names: Sequence[str]) -> Array:
        """(n_rows, n_names), NaN for columns that are not there."""
        absent = np.full(len(self.lines), np.nan)
        return np.stack([self.columns.get(name, absent) for name in names], axis=1)


@dataclass(frozen=True)
class Units:
    """What the user says of units: of all columns of a kind that state none, of single columns, and of a pixel."""

    of_kind: Mapping[Kind, str]
    of_column: Mapping[str, str]
    scales: Mapping[str, float]

    @classmethod
    def parse(cls, text: str | None, names: Sequence[str], who: str) -> Units:
        """`mm`, `mm,MPa`, `x:mm,ux:um` or `ux:px,px:0.02mm`. Raises InputError."""
        parts = [part.strip() for part in (text or "").split(",")] if text else []
        bare = [part for part in parts if not re.search("[:=]", part)]
        named = pairs(",".join(part for part in parts if part not in bare), who, "x:mm,ux:um") if parts != bare else {}
        scales = {PIXEL: quantity(named.pop(PIXEL), "length", f"{who}: {PIXEL}")} if PIXEL in named else {}
        check_known(named, names, who)
        of_kind: dict[Kind, str] = {}
        for unit in bare:
            kind = kind_of(unit, who)
            if kind in of_kind:
                raise InputError(f"{who}: {of_kind[kind]} and {unit} for every {kind} - name columns, as in x:mm,ux:um")
            of_kind[kind] = unit
        return cls(of_kind, named, scales)

    def applied(self, column: Column, kind: Kind) -> Column:
        return replace(column, unit=self.of_column.get(column.name, column.unit or self.of_kind.get(kind)))


def read_table(
    path: str | Path, groups: Sequence[Group], columns: str | None = None, units: str | None = None
) -> Table:
    """Read the columns of `groups`.

    columns  `x:NAME,ux:NAME`: the header of a column, with or without its unit; `x:NAME - 10mm`: shifted; `y:3mm`: one
             value for all rows
    units    see `Units.parse`. A header states its unit in brackets: `x-coordinate [mm]`, `ux (um)`. Columns without
             a unit are taken as they are.

    Raises InputError for what cannot be read or understood, naming the line or the column.
    """
    file = NumberFile.opened(path)
    kinds = {name: group.kind for group in groups for name in group.names}
    constants, headers, shifts = _assigned(columns, kinds, f"{path}: columns={columns}")
    found, others = match(file, [name for name in kinds if name not in constants], headers)
    for group in groups:
        _check_need(file, group, {*found, *constants})
    said_of_units = Units.parse(units, [*kinds], f"{path}: units={units}")
    kinds |= _by_unit(path, groups, found, said_of_units)
    for kind, unit in said_of_units.of_kind.items():
        if not any(kinds[name] == kind and column.unit is None for name, column in found.items()):
            raise InputError(
                f"{path}: units={unit}: no column without a unit is a {kind} - name columns, as in x:{unit}"
            )
    found = {name: said_of_units.applied(column, kinds[name]) for name, column in found.items()}
    for group in groups:
        _check_mixed(path, [found[name] for name in group.names if name in found], said_of_units)
    for kind in {*kinds.values()}:
        _check_missing(path, [column for name, column in found.items() if kinds[name] == kind])
    factors = {
        name: factor(column.unit, kinds[name], f"{path}: column {column.header}", said_of_units.scales)
        for name, column in found.items()
        if column.unit is not None
    }
    numeric = [column for column in found.values() if kinds[column.name] != "word"]
    words = {c.name: np.array(file.words(c.place)) for c in found.values() if c not in numeric}
    gaps = {found[name].place for group in groups if group.gaps for name in group.names if name in found}
    marked = {name for group in groups if group.marked for name in group.names}
    numbers, lines = file.read([column.place for column in numeric], gaps)
    if not lines.size:
        raise InputError(f"{path}: has a header and no rows - add one row a measured point")
    read = {}
    for column, raw in zip(numeric, numbers, strict=True):
        if column.name in marked:
            _check_sentinel(path, column, raw, lines)
        raw *= factors.get(column.name, 1.0)
        raw += shifts.get(column.name, 0.0) + zero(column.unit or "", kinds[column.name])
        read[column.name] = raw
    every_row = {name: np.full(len(lines), value) for name, value in constants.items()}
    values = {name: f"shifted by {value:g}" for name, value in shifts.items()}
    values |= {name: f"= {value:g} in every row" for name, value in constants.items()}
    stated = {name: column.unit for name, column in found.items() if column.unit is not None}
    how = {name: f"in {unit}, factor {factors[name]:g}" for name, unit in stated.items()}
    how |= {name: f"in {unit}, plus {add:g}" for name, unit in stated.items() if (add := zero(unit, kinds[name]))}
    return Table(path, read | every_row | words, lines, _said(found.values(), how, values, others), stated)


def _by_unit(path: str | Path, groups: Sequence[Group], found: Mapping[str, Column], units: Units) -> dict[str, Kind]:
    """The kinds of columns whose unit tells them."""
    stated = {
        name: (kind_of(unit, f"{path}: column {found[name].header}"), group.others)
        for group in groups
        for name in group.names
        if group.others and name in found and (unit := units.of_column.get(name, found[name].unit))
    }
    return {name: kind for name, (kind, others) in stated.items() if kind in others}


def _assigned(
    columns: str | None, kinds: Mapping[str, Kind], who: str
) -> tuple[dict[str, float], dict[str, str], dict[str, float]]:
    """Values for all rows, headers, and what to add to their numbers [SI], by name."""
    given = {} if columns is None else pairs(columns, who, "columns=x:NAME,ux:NAME, a name of the header each")
    check_known(given, [*kinds], who)
    values = {name: text for name, text in given.items() if re.match(r"[-+]?\.?\d", text)}
    constants = {name: quantity(text, kinds[name], f"{who}: {name}") for name, text in values.items()}
    headers = {name: text for name, text in given.items() if name not in values}
    shifts = {
        name: parts for name, text in headers.items() if (parts := re.fullmatch(r"(.*\S)\s+([-+]) *(\d.*)", text))
    }
    headers |= {name: parts[1] for name, parts in shifts.items()}
    changes: dict[Kind, Kind] = {"temperature": "temperature change"}
    added = {
        name: quantity(parts[2] + parts[3], changes.get(kinds[name], kinds[name]), f"{who}: {name}")
        for name, parts in shifts.items()
    }
    return constants, headers, added


def _check_need(file: NumberFile, group: Group, there: set[str]) -> None:
    missing = [name for name in group.names if name not in there]
    if (group.need == "all" and missing) or (group.need == "any" and len(missing) == len(group.names)):
        raise InputError(
            f"{file.path}: no column {', '.join(missing)}; it has {file.listed} - rename or add it, or name it:"
            f" columns={missing[0]}:NAME"
        )


def _check_mixed(path: str | Path, columns: Sequence[Column], units: Units) -> None:
    """Raises InputError for a unit that is not known, and for one quantity in several units, unless the user has named
    the unit of each column.
    """
    stated = {
        column.unit: kind_of(column.unit, f"{path}: column {column.name}")
        for column in columns
        if column.unit is not None
    }
    if len(stated) > 1 and not {column.name for column in columns} <= {*units.of_column}:
        pairs_ = [f"{column.name}:{column.unit or '?'}" for column in columns]
        raise InputError(
            f"{path}: mixed units, {', '.join(pairs_)} - if that is right say so: units={','.join(pairs_)}"
        )


def _check_missing(path: str | Path, columns: Sequence[Column]) -> None:
    """Raises InputError where some columns state a unit and others do not."""
    without = [column for column in columns if column.unit is None]
    if without and len(without) < len(columns):
        stated = next(column for column in columns if column.unit is not None)
        raise InputError(
            f"{path}: mixed units: {stated.name} is in {stated.unit}, {without[0].name} ({without[0].header}) states no"
            f" unit - state it: units={without[0].name}:{stated.unit}"
        )


def _check_sentinel(path: str | Path, column: Column, values: Array, lines: Array) -> None:
    """Raises InputError for numbers like -999 that mark missing values: whole and far from all others, which are of
    nines or repeated; or of nines and repeated among numbers that are not whole.
    """
    size = np.abs(np.nan_to_num(values))
    fractions = bool((size != np.round(size)).any())
    for mark in (float(size.max()), *NINES):
        at = np.flatnonzero(size == mark)
        nines, others = mark in NINES, float(size[size < mark].max(initial=0.0))
        repeated, whole = len(at) > 1, mark >= SENTINEL and mark == round(mark)
        telling = (nines and len(size) > 1) or (repeated and others > 0.0)
        far = telling and mark == size.max() > APART * others
        if whole and at.size and (far or (nines and repeated and fractions)):
            raise InputError(
                f"{path}: column {column.header} holds {values[at[0]]:g} in {len(at)} of {len(values)} rows, first in"
                f" line {lines[at[0]]}: a mark of missing values? - leave such cells empty or remove the rows"
            )


def _said(
    columns: Iterable[Column], conversions: Mapping[str, str], values: Mapping[str, str], others: Sequence[str]
) -> str:
    by_unit: dict[str, list[str]] = {}
    for column in columns:
        how = conversions.get(column.name, "as given")
        what = column.name if column.header == column.name else f"{column.name} = {column.header}"
        by_unit.setdefault(how, []).append(what)
    parts = [f"{', '.join(names)} {how}" for how, names in by_unit.items()]
    parts += [f"{name} {value}" for name, value in values.items()]
    parts += [f"not read: {', '.join(others)}"] if others else []
    plainly = len(parts) == 1 and not conversions and " = " not in parts[0]
    return "" if plainly else f"read {' / '.join(parts)}"
