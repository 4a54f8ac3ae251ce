"""The source that an object's code is made of: its file and what that imports of its own project, and of this one."""

from __future__ import annotations

import ast
import hashlib
import itertools
import os
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import gradient_routes
from gradient_routes.routes.route import Route

HERE = Path(gradient_routes.__file__).absolute().parent.parent  # what `gradient_routes` is imported from
OURS = ("gradient_routes.problems", "gradient_routes.routes")  # floors that a gradient can depend on


Stamp = tuple[str, int, int]  # a file, when it was last written [ns], its size


@dataclass(frozen=True)
class Source:
    """Where code is: its file, absolute, and its module; None and its full name where it has no file to be read."""

    file: str | None
    module: str


def source(target: Any) -> Source:
    """Of a factory or a Route."""
    function = target.function if isinstance(target, Route) else target
    module = sys.modules.get(getattr(function, "__module__", None) or "")
    name, file = getattr(module, "__name__", ""), getattr(module, "__file__", None)
    return _source(name, file, getattr(function, "__qualname__", ""))


@cache
def _source(module: str, file: str | None, function: str) -> Source:
    """Places are few, the rows that ask for them many."""
    if file is None or not Path(file).is_file():
        return Source(None, f"{module}.{function}")
    return Source(str(Path(file).absolute()), module)


def digest(source: Source) -> str:
    """Of what the code is made of; of its name where it has no file. Reads files, runs nothing."""
    return _read(source)[0]


def stamps(source: Source) -> tuple[Stamp, ...]:
    """The files that the digest is of, as they were when it was taken."""
    return _read(source)[1]


def stamp(file: Path) -> Stamp:
    status = file.stat()
    return str(file), status.st_mtime_ns, status.st_size


def changed(known: tuple[Stamp, ...]) -> str | None:
    """The first of these files that is no longer as it was."""
    for name, *then in known:
        file = Path(name)
        if not file.is_file() or [*stamp(file)[1:]] != then:
            return name
    return None


@cache
def _read(source: Source) -> tuple[str, tuple[Stamp, ...]]:
    if source.file is None:
        return hashlib.sha256(source.module.encode()).hexdigest(), ()
    return _digest(Path(source.file), source.module)


def _digest(path: Path, module: str) -> tuple[str, tuple[Stamp, ...]]:
    if not path.is_file():
        raise FileNotFoundError(path)
    alone = module.startswith("_routes_")  # a file that was named, see bench.cases.imported
    above = 0 if alone else module.count(".") + (path.name == "__init__.py")
    root = path.parents[min(above, len(path.parents) - 1)]
    summed = hashlib.sha256()
    files = closure(path, root, None if alone else module.partition(".")[0])
    known = tuple(stamp(file) for file in sorted(files))  # first: what is written while it is read shows later
    for name, source in sorted((file.name, file.read_bytes()) for file in files):  # wherever they are installed
        summed.update(name.encode() + b"\0" + source + b"\0")
    return summed.hexdigest(), known


def closure(path: Path, root: Path, top: str | None) -> set[Path]:
    """`path` and every file below `root` that it imports, directly or not: those of package `top`, or whatever lies
    beside where that is None; and those of this project's lower floors.
    """
    found: set[Path] = set()
    looked: set[str] = set()
    waiting = [path]
    while waiting:
        file = waiting.pop()
        if file in found:
            continue
        found.add(file)
        names = imported_names(file, root if file.is_relative_to(root) else HERE)
        for name in {*itertools.chain(*map(defined_in, names))} - looked:
            looked.add(name)
            if name.startswith(OURS):
                waiting += located(name, HERE)
            elif top is None or (name.partition(".")[0] == top != gradient_routes.__name__):
                waiting += located(name, root)
    return found


def imported_names(file: Path, root: Path) -> Iterator[str]:
    """Dotted names that a file imports anywhere, relative ones resolved; of `from a import b` both a and a.b, of
    `import a` and `from a import *` also a.*.
    """
    package = file.parent.relative_to(root).parts if file.is_relative_to(root) else ()
    for node in _imports(file.read_bytes()):
        if isinstance(node, ast.Import):
            yield from (name for alias in node.names for name in (alias.name, f"{alias.name}.*"))
        else:
            above = package[: len(package) - node.level + 1] if node.level else ()
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield base
            yield from (f"{base}.{alias.name}".lstrip(".") for alias in node.names)


@cache
def _imports(code: bytes) -> tuple[ast.Import | ast.ImportFrom, ...]:
    """Anywhere among the statements of a file: most of its nodes are of expressions, which have none."""
    try:
        waiting: list[ast.AST] = [ast.parse(code)]
    except (SyntaxError, ValueError, RecursionError, MemoryError):  # it will say so itself when it is imported
        return ()
    found = []
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            found.append(node)
        else:
            waiting += (child for child in ast.iter_child_nodes(node) if not isinstance(child, ast.expr))
    return tuple(found)


def defined_in(name: str) -> Iterable[str]:
    """The modules of public names of this package, `gradient_routes.Problem` say; other names as they are."""
    package, _, public = name.partition(".")
    if package != gradient_routes.__name__:
        return [name]
    return gradient_routes.PUBLIC.values() if public == "*" else [gradient_routes.PUBLIC.get(public, name)]


def located(name: str, root: Path) -> list[Path]:
    """The files a dotted name loads, of those below root: every package's __init__ on the way, and the module."""
    files: list[str] = []
    here = str(root)
    for part in name.split("."):  # by strings: paths take longer to put together than to look for
        here = os.path.join(here, part)
        files += [f for f in (os.path.join(here, "__init__.py"), f"{here}.py") if os.path.isfile(f)]
    return [path for path in map(Path, files) if path.parent != HERE / gradient_routes.__name__]
