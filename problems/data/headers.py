"""Which column of a measured file holds what: by its header, or as the user says."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from gradient_routes.problems.data.csv import NumberFile
from gradient_routes.problems.errors import InputError

# rows that such a column tells apart belong to several J: fitted as one they give a wrong answer
CASES = ("load", "loadx", "loady", "loadz", "loadcase", "case", "frame", "step", "time")
IN_FULL = {"t": "time", "T": "temperature"}  # names that differ by case alone


@dataclass(frozen=True)
class Column:
    """name by which a problem knows it; header without its unit; place in the file; unit, None where none is stated."""

    name: str
    header: str
    place: int
    unit: str | None


def match(file: NumberFile, names: Sequence[str], given: Mapping[str, str]) -> tuple[dict[str, Column], list[str]]:
    """The columns of the file by name, and the headers of all others. `given` maps names to headers.

    Raises InputError for two columns of one name, a header that is not there, and columns that tell cases apart.
    """
    split = [split_header(header) for header in file.names]
    taken = {k for k, (header, _) in enumerate(split) if {file.names[k], header} & {*given.values()}}
    found = {}
    for name in names:
        if name in given:
            places = [k for k, (header, _) in enumerate(split) if given[name] in (header, file.names[k])]
            if not places:
                raise InputError(
                    f"{file.path}: no column {given[name]}; it has {file.listed} - correct columns={name}:"
                )
        else:
            places = [k for k, (header, _) in enumerate(split) if k not in taken and means(header, name, names)]
        if len(places) > 1:
            where = ", ".join(f"column {k + 1} is {file.names[k]}" for k in places)
            raise InputError(
                f"{file.path}: column {name} is given {len(places)} times ({where}) - keep one, or name one, as in"
                f" columns={name}:{file.names[places[0]]}"
            )
        if places:
            found[name] = Column(name, split[places[0]][0], places[0], split[places[0]][1])
    rest = {*range(len(split))} - {column.place for column in found.values()}
    others = [file.names[k] for k in sorted(rest) if file.names[k]]
    telling = [header for header in others if plain(split_header(header)[0]) in CASES]
    if telling:
        cases = f", or name it the case beside a column load: columns=case:{telling[0]}" if "case" in names else ""
        raise InputError(
            f"{file.path}: column {telling[0]} tells cases apart, and as one their rows would be fitted wrongly - keep"
            f" the rows of one {telling[0]} and remove the column{cases}"
        )
    return found, others


def means(header: str, name: str, names: Sequence[str]) -> bool:
    """Whether a header without its unit stands for `name` among `names`."""
    if plain(header) == IN_FULL.get(name):
        return True
    return header == name or (header not in names and plain(header) == plain(name))


def plain(name: str) -> str:
    """A name without what people write differently: X, x-coordinate and coordinate_x are x, u_x is ux."""
    short = re.sub(r"[-_ .]", "", name).lower().replace("coordinate", "")
    return re.sub(r"^([xyz])displacement$|^displacement([xyz])$", r"u\1\2", short)


def split_header(header: str) -> tuple[str, str | None]:
    """Name and unit: `x-coordinate [mm]`, `ux (um)`."""
    parts = re.fullmatch(r"(.*?\S)\s*(?:\[([^][]*)\]|\(([^()]*)\))", header)
    return (parts[1], (parts[2] or parts[3] or "").strip() or None) if parts else (header, None)


def pairs(text: str, who: str, example: str) -> dict[str, str]:
    """`a:b,c:d`, or with = in place of the colons; commas may be part of the values. Raises InputError."""
    found: dict[str, str] = {}
    for item in re.split(r",(?=\s*\w+\s*[:=])", text):
        pair = re.fullmatch(r"\s*(\w+)\s*[:=]\s*(.*\S)\s*", item)
        if pair is None:
            raise InputError(f"{who}: '{item.strip()}' is no pair - write {example}")
        if pair[1] in found:
            raise InputError(f"{who}: {pair[1]} is given twice - keep one")
        found[pair[1]] = pair[2]
    return found


def check_known(given: Iterable[str], names: Sequence[str], who: str) -> None:
    """Raises InputError for a name that no column has."""
    for name in given:
        if name not in names:
            raise InputError(f"{who}: nothing is called {name} - the names are {', '.join(names)}")
