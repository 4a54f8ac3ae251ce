"""Objects of other people's files: `FILE.py:NAME` or `package.module:NAME`."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.problems.errors import InputError, RoutesError


def is_reference(text: str) -> bool:
    """Whether `text` points into a file or module rather than into the registry."""
    return ":" in text


def imported(text: str) -> Any:
    """The object that `text` points to. Raises InputError for what cannot be found, RoutesError where it fails."""
    where, _, name = text.rpartition(":")
    if not where or not name:
        raise InputError(f"'{text}' - write FILE.py:NAME or package.module:NAME")
    module = _module(where, text)
    found: Any = module
    for part in name.split("."):
        own = vars(found) if hasattr(found, "__dict__") else {}
        known = [n for n, value in own.items() if not n.startswith("_") and not isinstance(value, ModuleType)]
        if part not in known and not hasattr(found, part):
            raise InputError(f"'{text}': {where} has no '{part}' - {did_you_mean(part, known) or 'it defines nothing'}")
        found = getattr(found, part)
    return found


def _module(where: str, text: str) -> ModuleType:
    path = located(where)
    if path.suffix != ".py":
        return _loaded(lambda: importlib.import_module(where), text)
    if not path.is_file():
        raise InputError(f"'{text}': no file {where} here - check the path")
    return _loaded(lambda: _of_file(path.resolve()), text)


@cache
def _of_file(path: Path) -> ModuleType:
    """The module of a file, run once however often it is named."""
    import hashlib  # OpenSSL with it: `routes --help` starts without

    name = f"_routes_{path.stem}_{hashlib.sha256(str(path).encode()).hexdigest()[:8]}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickles look themselves up there
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))  # what stands beside the file can be imported by it, and hides nothing
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _loaded(load: Callable[[], ModuleType], text: str) -> ModuleType:
    try:
        with stdout_to_stderr():
            return load()
    except MemoryError:
        raise
    except (Exception, SystemExit) as error:  # code of others may raise anything while it is imported
        said = " ".join(str(error).split())
        absent = isinstance(error, ModuleNotFoundError) and text.startswith(f"{error.name}")
        kind = InputError if absent else RoutesError  # a wrong name, or code that fails
        raise kind(f"'{text}' cannot be imported: {type(error).__name__}: {said} - mend it") from error
