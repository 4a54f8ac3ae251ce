"""The command line: a command for every registered study, and those about a store. It imports nothing heavy."""

from __future__ import annotations

import click

from gradient_routes.bench.commands.advise import advise
from gradient_routes.bench.commands.compare import baseline, compare
from gradient_routes.bench.commands.completion import with_completion
from gradient_routes.bench.commands.environments import environments
from gradient_routes.bench.commands.export import export
from gradient_routes.bench.commands.group import Routes
from gradient_routes.bench.commands.lab import lab
from gradient_routes.bench.commands.list import list_
from gradient_routes.bench.commands.merge import merge
from gradient_routes.bench.commands.report import report
from gradient_routes.bench.commands.serve import serve
from gradient_routes.bench.commands.status import status
from gradient_routes.bench.commands.version import print_version
from gradient_routes.bench.studies.command import commands_of_studies

OTHERS: list[click.Command] = [
    *(advise, list_, status, report, export, merge, compare, baseline, environments, serve, lab),
]
VERSION = "Show the version, the commit of a checkout and the version of Python."


@click.group(cls=Routes, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option("--version", is_flag=True, expose_value=False, is_eager=True, callback=print_version, help=VERSION)
def main() -> None:
    """Gradients of PDE-constrained objectives: every route to dJ/dp, what it costs and how wrong it is.

    \b
    routes list                                  problems and routes, all options
    routes advise --parameters 5000              which route to take, and why
    routes run --problem bar --route adjoint     one gradient, its cost and error
    routes run --problem 'bar[n=8|64]' --route all
    routes vcurve --problem bar --route adjoint  a verdict, by finite differences
    routes check my_model.py:Model               the same for your own code

    A file that an option names is written whole or not at all. An earlier one of the same kind is replaced. A source,
    a store, what the command reads, any other file, or a link to one of these is refused.

    Shell completion: eval "$(_ROUTES_COMPLETE=bash_source routes)" in ~/.bashrc; zsh_source in ~/.zshrc; in
    ~/.config/fish/completions/routes.fish: _ROUTES_COMPLETE=fish_source routes | source
    """


for command in (*commands_of_studies(), *OTHERS):
    main.add_command(with_completion(command))
