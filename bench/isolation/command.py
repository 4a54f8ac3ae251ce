"""A verb of the command line as a confined process: limits as JSON, the parent's number, then the verb."""

from __future__ import annotations

import json
import sys

from bench.isolation.inside import submit_to
from bench.isolation.limits import Limits


def main() -> None:
    """Submit to limits, then run the verb as if it had been called."""
    given, parent, *arguments = sys.argv[1:]
    values = json.loads(given)
    affinity = values["affinity"]
    limits = Limits(memory=values["memory"], threads=values["threads"], affinity=affinity and tuple(affinity))
    submit_to(limits, int(parent))
    sys.argv = ["routes", *arguments]
    from bench.cli import main as routes
    from bench.commands.limited import INSIDE

    routes(arguments, prog_name="routes", obj=INSIDE)


if __name__ == "__main__":
    main()
