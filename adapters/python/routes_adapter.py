"""The other side of the adapter protocol, version 1, for adapters in Python. Import it before the framework.

It stands alone: Python 3.9, NumPy, nothing else of this project. From its import on what is printed goes to stderr.

    class Torch:
        def load(self, case): ...            # raises Unsupported
        def value(self, p): ...              # J
        def gradient(self, p, rtol, adjoint_rtol, **options): ...   # {"J": ..., "gradient": ..., ...}

    serve(Torch(), name="torch-fem", versions=["torch", "torch-fem"])
"""

import base64
import contextlib
import ctypes
import json
import os
import sys
import traceback
from importlib.metadata import version
from itertools import count

_OUT = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)  # frameworks print while they are imported, and from C
_IN = sys.stdin.buffer

import numpy as np

PROTOCOL, FRAMED = 1, 65_536
MEASURED = 2  # calls of `gradient` whose memory is measured, which takes 0.1 ms: one compiles, the next does not
_gradients = count()


class Refusal(Exception):
    """An error with a kind of the protocol."""

    kind = "bug"


class NotConverged(Refusal):
    kind = "not-converged"


class Singular(Refusal):
    kind = "singular"


class Domain(Refusal):
    kind = "domain"


class Unsupported(Refusal):
    kind = "unsupported"


KINDS = {MemoryError: "memory", np.linalg.LinAlgError: "singular"}


def connect(folder):
    """Speak by the descriptors 3 and 4 of the process whose folder of descriptors this is, not by stdin and stdout."""
    global _IN, _OUT
    _IN, _OUT = open(f"{folder}/3", "rb"), open(f"{folder}/4", "wb")  # noqa: SIM115 - as long as it serves


def serve(adapter, name, versions=(), kinds=None, **about):
    """Answers until `bye` or the end of input.

    kinds: of the errors that a framework raises, {AssertionError: "not-converged"}. `about`: more of what `describe`
    says.
    """
    kinds = {**KINDS, **(kinds or {})}
    while True:
        line = _IN.readline()
        if not line:
            return
        asked = _unpacked(json.loads(line))
        method, arguments = asked.pop("method"), {k: v for k, v in asked.items() if k != "id"}
        try:
            if method == "describe":
                known = {each: version(each) for each in versions}
                said = {"protocol": PROTOCOL, "name": name, "versions": known, **about}
            elif method == "bye":
                said = {}
            elif method == "gradient" and next(_gradients) < MEASURED:
                said = _measured(adapter.gradient, arguments)
            else:
                said = getattr(adapter, method)(**arguments)
            _send({"id": asked["id"], "result": said if isinstance(said, dict) else {"J": said}})
        except Exception as error:
            known = next((kinds[each] for each in kinds if isinstance(error, each)), "bug")
            kind = getattr(error, "kind", known)
            if kind == "bug":
                traceback.print_exc()
            message = str(error) if isinstance(error, Refusal) else f"{type(error).__name__}: {error}"
            _send({"id": asked["id"], "error": {"kind": kind, "message": message}})
        if method == "bye":
            return


def _measured(gradient, arguments):
    """Its answer, with the peak memory of the call above what was held before, where Linux tells it."""
    with contextlib.suppress(AttributeError):
        ctypes.CDLL(None).malloc_trim(0)  # what glibc keeps of freed memory would be reused unseen
    try:
        with open("/proc/self/clear_refs", "w") as file:
            file.write("5")  # the peak starts anew
        before = _bytes("VmRSS")
    except OSError:
        return gradient(**arguments)
    said = gradient(**arguments)
    return {**said, "peak_bytes": said.get("peak_bytes", max(0, _bytes("VmHWM") - before))}


def _bytes(field):
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith(field + ":"))


def _send(message):
    frames = []
    _OUT.write(json.dumps(_packed(message, frames)).encode() + b"\n")
    for frame in frames:
        _OUT.write(frame)
    _OUT.flush()


def _packed(value, frames):
    if isinstance(value, dict):
        return {key: _packed(each, frames) for key, each in value.items()}
    if isinstance(value, (np.generic, np.ndarray)) and value.ndim == 0:
        return value.item()
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype.kind not in "fiub":
        raise TypeError(f"an array of {value.dtype} - give real numbers")
    array = np.ascontiguousarray(value, "<f8")
    if array.nbytes < FRAMED:
        return {"float64": array.shape, "base64": base64.b64encode(array.tobytes()).decode()}
    frames.append(array.tobytes())
    return {"float64": array.shape, "frame": array.nbytes}


def _unpacked(value):
    if isinstance(value, list):
        return [_unpacked(each) for each in value]
    if not isinstance(value, dict):
        return value
    for name, dtype in (("float64", "<f8"), ("int64", "<i8")):
        if name in value:
            data = _IN.read(value["frame"]) if "frame" in value else base64.b64decode(value["base64"])
            return np.frombuffer(data, dtype).reshape(value[name]).copy()
    return {key: _unpacked(each) for key, each in value.items()}
