"""`routes serve`: our problems for the samplers and optimizers of others."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gradient_routes.bench.command_options import complain, debug_option, solver_options
from gradient_routes.bench.commands.group import INTERRUPTED, leave
from gradient_routes.bench.commands.interrupts import over
from gradient_routes.bench.ranges import Whole
from gradient_routes.bench.sanitize import echo
from gradient_routes.bench.studies.options import problem_option

if TYPE_CHECKING:
    from gradient_routes.routes.newton import Solver

PORT = "0: any that is free."
HOST = "The address to listen on. Beyond this machine there is neither password nor encryption."


@click.command()
@problem_option
@click.option("--route", default="adjoint", show_default=True, metavar="SELECTOR", help="Of the gradient of J.")
@click.option("--port", type=Whole(0, 65_535), default=4242, show_default=True, help=PORT)
@click.option("--host", default="127.0.0.1", show_default=True, metavar="ADDRESS", help=HOST)
@solver_options
@debug_option
def serve(selector: str, route: str, port: int, host: str, solver: Solver) -> None:
    """Offer a problem over UM-Bridge, the protocol of samplers and optimizers, until Ctrl-C.

    \b
    routes serve --problem bar
    routes check umbridge:http://127.0.0.1:4242#objective

    Model objective is J(p), with the gradient by the route. Model observations is S u(p), where the problem has
    any. Both have Evaluate, Gradient and ApplyJacobian.
    """
    from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
    from gradient_routes.bench.protocols.served import models
    from gradient_routes.bench.protocols.server import Offered, Server
    from gradient_routes.bench.studies.options import one_route, problem_at

    spec, (problem, _) = one_route(route), problem_at(selector)
    with stdout_to_stderr():
        offered = Offered(models(problem, spec, solver), problem.parameters, problem.name)
    with Server(host, port, offered) as server:
        sizes = ", ".join(f"{name} ({model.m})" for name, model in offered.models.items())
        try:
            echo(f"{problem.name}, {len(problem.parameters)} parameters: {sizes} at {server.url} until Ctrl-C")
            with stdout_to_stderr():
                server.serve_forever()
        except KeyboardInterrupt:
            over()
            complain(f"interrupted - {offered.answered} evaluations, gradients and products answered")
            leave(INTERRUPTED)
