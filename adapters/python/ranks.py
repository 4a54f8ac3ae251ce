"""An adapter that runs on several processes of MPI: rank 0 speaks the protocol, all do what it is asked."""

import os
import traceback

from routes_adapter import Refusal, connect, serve


class _Together:
    """On rank 0: tells the other ranks what they are to do with it."""

    def __init__(self, adapter, comm):
        self.adapter, self.comm = adapter, comm

    def __getattr__(self, method):
        def call(**arguments):
            self.comm.bcast((method, arguments))
            return getattr(self.adapter, method)(**arguments)

        return call


def serve_on_ranks(adapter, comm, name, **about):
    """See `serve`. A Refusal has to occur on all ranks; another error on one of the others ends all."""
    if comm.rank == 0:
        if "ROUTES_ADAPTER" in os.environ:
            connect(os.environ["ROUTES_ADAPTER"])
        try:
            serve(_Together(adapter, comm), name, **about)
        finally:
            comm.bcast(None)
        return
    while (asked := comm.bcast(None)) is not None:
        method, arguments = asked
        try:
            getattr(adapter, method)(**arguments)
        except Refusal:
            continue  # rank 0 answers with it
        except Exception:
            traceback.print_exc()
            comm.Abort()
