"""Messages between the harness and an adapter, version 1: JSON lines, arrays as base64 or as frames behind the line.

    message  a JSON object on one line, in ASCII, ended by a newline
    array    {"float64": SHAPE, "base64": TEXT}, or {"float64": SHAPE, "frame": BYTES}: so many bytes follow the
             newline, frame by frame in the order in which a reader of the line meets them. "int64" likewise.
             Little-endian, in C order.

docs/explanation/adapter-protocol.md describes the methods. adapters/routes_adapter.py is the other side, on its own.
"""

from __future__ import annotations

import base64
import binascii
import json
import math
from typing import IO, Any

import numpy as np

from gradient_routes.problems.errors import RoutesError

VERSION = 1
FRAMED = 65_536  # bytes from which an array is sent as a frame: base64 makes them a third more, and copies them thrice
LONGEST = 64_000_000  # bytes of a line
LARGEST = 2**34  # bytes of a frame
DTYPES = {"float64": np.dtype("<f8"), "int64": np.dtype("<i8")}
SHOWN = 80  # characters of what is no message


class NoMessage(RoutesError):
    """What arrived is no message of the protocol."""


class Ended(RoutesError):
    """The other side has closed its end."""


def send(stream: IO[bytes], message: dict[str, Any]) -> None:
    """Raises BrokenPipeError where nobody reads."""
    frames: list[Any] = []
    stream.write(json.dumps(_packed(message, frames)).encode() + b"\n")
    for frame in frames:
        stream.write(frame)
    stream.flush()


def receive(stream: IO[bytes]) -> dict[str, Any]:
    """Raises Ended, and NoMessage for anything else than a message."""
    line = stream.readline(LONGEST)
    if not line:
        raise Ended("nothing more to read")
    try:
        message = json.loads(line)
    except (ValueError, RecursionError):
        raise NoMessage(f"it wrote {line[:SHOWN]!r}{' ...' if len(line) > SHOWN else ''}") from None
    if not isinstance(message, dict):
        raise NoMessage(f"it wrote {line[:SHOWN]!r}, which is no JSON object")
    whole: dict[str, Any] = _unpacked(message, stream)
    return whole


def _packed(value: Any, frames: list[Any]) -> Any:
    if isinstance(value, np.ndarray):
        name = "int64" if value.dtype.kind in "biu" else "float64"
        array = np.asarray(value, DTYPES[name], order="C")
        if array.nbytes < FRAMED:
            return {name: array.shape, "base64": base64.b64encode(array.tobytes()).decode()}
        frames.append(array.reshape(-1).view(np.uint8).data)
        return {name: array.shape, "frame": array.nbytes}
    if isinstance(value, dict):
        return {key: _packed(each, frames) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_packed(each, frames) for each in value]
    return value.item() if isinstance(value, np.generic) else value


def _unpacked(value: Any, stream: IO[bytes]) -> Any:
    if isinstance(value, list):
        return [_unpacked(each, stream) for each in value]
    if not isinstance(value, dict):
        return value
    name = next(iter(value.keys() & DTYPES.keys()), None)
    if name is None:
        return {key: _unpacked(each, stream) for key, each in value.items()}
    return _array(DTYPES[name], value[name], value, stream)


def _array(dtype: Any, shape: Any, value: dict[str, Any], stream: IO[bytes]) -> np.ndarray[Any, Any]:
    whole = isinstance(shape, list) and all(isinstance(n, int) and n >= 0 for n in shape)
    if not whole or not ("base64" in value or "frame" in value):
        raise NoMessage(f"an array of shape {shape} with {', '.join(value)}: give base64 or frame")
    wanted = dtype.itemsize * math.prod(shape)
    if "frame" in value:
        if value["frame"] != wanted or wanted > LARGEST:
            raise NoMessage(f"a frame of {value['frame']} bytes for an array of shape {shape}, which has {wanted}")
        data = stream.read(wanted)
    else:
        try:
            data = base64.b64decode(value["base64"], validate=True)
        except (TypeError, ValueError, binascii.Error):
            raise NoMessage("an array that is no base64") from None
    if len(data) != wanted:
        raise NoMessage(f"{len(data)} bytes for an array of shape {shape}, which has {wanted}")
    return np.frombuffer(data, dtype).reshape(shape)
