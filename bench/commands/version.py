"""`routes --version`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from gradient_routes.bench.sanitize import echo


def print_version(context: click.Context, _: click.Parameter, asked: bool) -> None:
    """The option's callback: print version, commit and Python, and exit."""
    if asked and not context.resilient_parsing:
        echo(version())
        context.exit()


def version() -> str:
    """The version of the package, the commit of its checkout if it runs from one, and the version of Python."""
    from importlib.metadata import version as installed

    commit = checked_out(Path(__file__).resolve().parents[2])
    python = ".".join(map(str, sys.version_info[:3]))
    return f"routes {installed('gradient-routes')}{f' (commit {commit})' if commit else ''}, Python {python}"


def checked_out(folder: Path) -> str | None:
    """The commit of a folder that is the root of a git checkout, `-dirty` where files differ from it; else None."""
    import subprocess

    if not (folder / ".git").exists():
        return None
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--exclude=*"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):  # no git, or a checkout it refuses to read
        return None
