"""The program `routes`. Its first import lets interrupts end it with one line and exit code 130."""

from __future__ import annotations

import os
import sys
from typing import Any

from gradient_routes.bench.commands.interrupts import begin, over


def main() -> None:
    """Run a command. Threads that user code has left do not keep the process."""
    begin()
    from gradient_routes.bench.cli import main as command

    try:
        command(prog_name="routes")
    except SystemExit as ended:
        over()
        leave_threads(ended.code)
        raise


def leave_threads(code: Any) -> None:
    """Exit at once where threads would be waited for: this program has none that matter by now."""
    import threading

    others = [thread for thread in threading.enumerate() if thread is not threading.main_thread()]
    if any(not thread.daemon for thread in others):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code if isinstance(code, int) else 0 if code is None else 1)


if __name__ == "__main__":
    main()
