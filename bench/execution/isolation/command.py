"""A verb of the command line as a confined process: limits as JSON, the parent's number and its line, then the verb."""

from __future__ import annotations

import json
import os
import signal
import sys
from types import FrameType

from gradient_routes.bench.execution.isolation.inside import submit_to
from gradient_routes.bench.execution.isolation.limits import Limits

ENDED = "ended"
EXPIRED = signal.SIGALRM  # its time is over: it ends as if interrupted


def main() -> None:
    """Submit to limits, then run the verb as if it had been called. The parent is told that it has come to its end, or
    for what allocation it has not: an exit code is what any code of others can leave with.
    """
    given, parent, line, *arguments = sys.argv[1:]
    os.set_inheritable(int(line), False)
    values = json.loads(given)
    affinity = values["affinity"]
    limits = Limits(memory=values["memory"], threads=values["threads"], affinity=affinity and tuple(affinity))
    submit_to(limits, int(parent))
    sys.argv = ["routes", *arguments]
    from gradient_routes.bench.cli import main as routes
    from gradient_routes.bench.execution.limited import Inside

    inside = Inside()

    def stop(number: int, frame: FrameType | None) -> None:
        """Once: a group may be told as a whole, and its parent pass it on, while this keeps what it has."""
        if not inside.stopped:
            inside.stopped, inside.expired = True, number == EXPIRED
            raise KeyboardInterrupt

    for number in (signal.SIGINT, signal.SIGTERM, EXPIRED):
        signal.signal(number, stop)
    try:
        routes(arguments, prog_name="routes", obj=inside)
    except SystemExit:  # how click ends
        os.write(int(line), ENDED.encode())
        raise
    except Exception as failure:
        from gradient_routes.bench.cases.status import one_line, status_of

        if status_of(failure) != "out-of-memory":
            raise
        os.write(int(line), one_line(failure)[:1000].encode())
        sys.exit(1)


if __name__ == "__main__":
    main()
