"""What an adapter's script says of itself in its inline metadata (PEP 723), read without running it.

A program in C has them in a comment.

    # /// script
    # requires-python = ">=3.11"
    # dependencies = ["torch==2.13.0"]
    # [tool.gradient-routes]
    # summary = "the equation or the strategy, in a line"
    # cases = { hyperelastic = { law = ["neo-hookean"] }, bar = {} }
    # options = { solver = ["direct", "cg"] }
    # ///

cases: the kinds of Problem.case() that it knows, with the values it knows where it does not know all. options: each
with its choices, the default first. environment, where it is not the script's name: one that adapters share. launch:
a command of the environment that starts it, ["mpiexec", "-n", "{ranks}"] with its options, where these are not the
defaults.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from gradient_routes.problems.errors import InputError

ADAPTERS = Path(__file__).absolute().parent.parent.parent / "adapters"
START = """import runpy, sys
sys.path[0] = sys.argv[1]
import routes_adapter  # before the framework: what is printed goes to stderr from then on
runpy.run_path(sys.argv[2], run_name="__main__")"""
# MPICH's mpiexec ends where a rank reads stdin slower than it is written, and writes to stdout itself
AROUND = 'exec 3<&0 4>&1; export ROUTES_ADAPTER=/proc/$$/fd; exec "$@" </dev/null >&2'
BLOCK = re.compile(r"(?m)^# /// script$\s(?P<content>(^#(| .*)$\s)+)^# ///$")  # PEP 723's own expression


@dataclass(frozen=True)
class Manifest:
    """Of one adapter. requires_python is a specifier; dependencies are as pip takes them."""

    name: str
    script: Path
    summary: str
    requires_python: str
    dependencies: tuple[str, ...]
    without_dependencies: tuple[str, ...]
    cases: Mapping[str, Mapping[str, list[Any]]]
    options: Mapping[str, list[str]]
    environment: str
    launch: tuple[str, ...] = ()

    @cached_property
    def folder(self) -> Path:
        """Of its environment: another one for every change of what it needs."""
        source = (self.script.read_text(),) if self.compiled else ()
        needs = "\n".join((self.requires_python, *self.dependencies, *self.without_dependencies, *source))
        return environments() / f"{self.environment}-{hashlib.sha256(needs.encode()).hexdigest()[:8]}"

    @property
    def compiled(self) -> bool:
        """Whether the script is a program in C, which has no interpreter and no packages."""
        return self.script.suffix == ".c"

    @property
    def program(self) -> Path:
        """What it is compiled to."""
        return self.folder / "adapter"

    @property
    def python(self) -> Path:
        return self.folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")

    @property
    def defaults(self) -> dict[str, str]:
        """Of its options."""
        return {name: choices[0] for name, choices in self.options.items()}

    def command(self, options: Mapping[str, str]) -> tuple[str, ...]:
        """That starts it. Its own folder is not searched for modules: adapters are named as what they adapt."""
        if self.compiled:
            return (str(self.program),)
        program = str(self.python), "-c", START, str(ADAPTERS / "python"), str(self.script)
        words = [word.format(**options) for word in self.launch]
        if words == [word.format(**self.defaults) for word in self.launch]:
            return program
        return "sh", "-c", AROUND, "sh", str(self.python.with_name(words[0])), *words[1:], *program

    @property
    def ready(self) -> bool:
        """Whether its environment has been made, to its end."""
        return self.mark.is_file()

    @property
    def mark(self) -> Path:
        """The file that is written last."""
        return self.folder / "ready"

    def unknown(self, case: Mapping[str, Any]) -> str | None:
        """What of a case it does not know, in a sentence; None where it knows all."""
        kind = str(case["kind"])
        if kind not in self.cases:
            return f"{self.name} knows {', '.join(self.cases) or 'no cases'}, not {kind}"
        for what, values in self.cases[kind].items():
            if case.get(what) not in values:
                return f"{self.name} knows {what} {', '.join(map(str, values))}, not {case.get(what)}"
        return None


def environments() -> Path:
    """The folder of all environments of adapters."""
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(cache) / "gradient-routes" / "environments"


def manifest(script: Path) -> Manifest:
    """Raises InputError for a script that has none, or a wrong one."""
    try:
        text = script.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"adapter {script}: cannot be read: {error} - check the path") from None
    found = BLOCK.search(text)
    if found is None:
        raise InputError(f"adapter {script}: has no inline metadata, a comment '# /// script' - see the guide")
    lines = found.group("content").splitlines()
    try:
        data = tomllib.loads("\n".join(line[2:] if line.startswith("# ") else line[1:] for line in lines))
        ours = data.get("tool", {}).get("gradient-routes", {})
        return Manifest(
            name=script.stem,
            script=script,
            summary=str(ours["summary"]),
            requires_python=str(data.get("requires-python", "")),
            dependencies=tuple(map(str, data.get("dependencies", []))),
            without_dependencies=tuple(map(str, ours.get("without-dependencies", []))),
            cases={str(kind): dict(known) for kind, known in ours["cases"].items()},
            options={str(name): list(map(str, choices)) for name, choices in ours.get("options", {}).items()},
            environment=str(ours.get("environment", script.stem)),
            launch=tuple(map(str, ours.get("launch", ()))),
        )
    except (tomllib.TOMLDecodeError, AttributeError, TypeError, ValueError) as error:
        raise InputError(f"adapter {script}: its inline metadata cannot be read: {error} - mend them") from None
    except KeyError as error:
        raise InputError(f"adapter {script}: its table tool.gradient-routes lacks {error} - add it") from None


def shipped() -> dict[str, Path]:
    """The adapters of this package: name -> script."""
    return {path.stem: path for path in sorted(ADAPTERS.iterdir()) if path.suffix in (".py", ".c")}
