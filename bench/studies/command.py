"""The command of a study, made from its declaration: options, limits, what is printed and what is kept."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.status import one_line
from gradient_routes.bench.cases.study import Study
from gradient_routes.bench.command_options import complain, debug_option, refuse_given, store_options
from gradient_routes.bench.execution.options import limit_options

if TYPE_CHECKING:
    from gradient_routes.bench.execution.isolation.limits import Limits

LAST = 10.0  # [s] to keep what there is when the time is over

no_plot_option = click.option("--no-plot", is_flag=True, help="Only the tables.")
json_option = click.option("--json", "as_json", is_flag=True, help="One JSON object a row and nothing else.")
one_json_option = click.option("--json", "as_json", is_flag=True, help="One JSON object and nothing else.")


def commands_of_studies() -> Iterator[click.Command]:
    """Those of all registered studies; a plug-in whose command cannot be made is left out, and that is said."""
    for study in registry.studies().values():
        try:
            yield command_of(study)
        except Exception as error:
            complain(f"study '{study.name}' is left out: {one_line(error)} - correct its declaration")


def command_of(study: Study) -> click.Command:
    """The click command `routes NAME`."""
    own = study.load("command")
    if isinstance(own, click.Command):
        return own
    options = [
        *study.options,
        *((no_plot_option,) if study.plots else ()),
        json_option if study.json is None else one_json_option,
        store_options,
        limit_options("it", 3600.0, LAST if study.keeps else 0.0) if study.confined else limit_options("a case", 600.0),
        debug_option,
    ]
    callback: Any = partial(_call, study)
    for option in reversed(options):
        callback = option(callback)
    return click.command(study.name, help=f"{study.question}\n\n{cleandoc(study.help)}")(callback)


def _call(
    study: Study,
    /,
    *,
    as_json: bool,
    kept: Path | None,
    no_plot: bool = False,
    isolate: bool,
    limits: Limits,
    **given: Any,
) -> None:
    from gradient_routes.bench.execution.isolation.run import here, stream
    from gradient_routes.bench.execution.isolation.signals import interruptible
    from gradient_routes.bench.studies.job import RunStudy, Screen
    from gradient_routes.bench.studies.session import Session

    for rule in study.rules:
        if not rule.when(given):
            refuse_given(rule.names, rule.why)
    if not study.confined:  # it runs cases that are
        given |= {"isolate": isolate, "limits": limits}
    job = RunStudy(study.name, given | {"kept": kept}, Screen.of_stdout(), as_json, not no_plot)
    session = Session(study, kept if study.stores is None or study.stores(given) else None, as_json)
    interruptible()  # SIGTERM acts like Ctrl-C
    if study.confined and isolate:
        for message in stream(job, limits, last_words=LAST if study.keeps else 0.0):
            session.hear(message)
    else:
        if not isolate:
            limits.pin()
        here(job, session.hear)
    raise click.exceptions.Exit(session.close())
