"""The messages as the guide shows them, and arrays of any shape on their way to an adapter and back."""

from __future__ import annotations

import io
import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import ROOT

from gradient_routes.problems.bar import Bar
from gradient_routes.problems.errors import SingularMatrix, Unsupported
from gradient_routes.routes.foreign import peer, protocol
from gradient_routes.routes.foreign.command import Command
from gradient_routes.routes.foreign.foreign import Foreign
from gradient_routes.routes.foreign.manifest import ADAPTERS, START
from gradient_routes.routes.foreign.protocol import Ended, NoMessage, receive, send
from gradient_routes.routes.newton import Solver

SCRIPT = Path(__file__).parent / "bar_adapter.py"
PROTOCOL = ROOT / "docs" / "explanation" / "adapter-protocol.md"
MINE = Command([sys.executable, "-c", START, str(ADAPTERS / "python"), str(SCRIPT)])


def transcripts() -> list[list[tuple[str, Any]]]:
    """Those of the guide: who speaks, and the message."""
    blocks = re.findall(r"^```text\n(-> .*?)^```$", PROTOCOL.read_text(), re.MULTILINE | re.DOTALL)
    return [[read(line[:2], line[3:]) for line in block.splitlines()] for block in blocks]


def read(who: str, line: str) -> tuple[str, Any]:
    return who, receive(io.BytesIO(line.encode()))


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Any]]:
    """What both sides write from now on."""
    messages: list[tuple[str, Any]] = []

    def sending(stream: Any, message: dict[str, Any]) -> None:
        line = io.BytesIO()
        send(line, message)
        messages.append(read("->", line.getvalue().decode()))
        send(stream, message)

    def receiving(stream: Any) -> dict[str, Any]:
        messages.append(("<-", receive(stream)))
        return messages[-1][1]

    monkeypatch.setattr(peer, "send", sending)
    monkeypatch.setattr(peer, "receive", receiving)
    return messages


def same(said: Any, shown: Any) -> None:
    """Names in their order, texts and arrays; versions change, and numbers are those of another machine."""
    if isinstance(shown, dict):
        assert [*said] == [*shown]
        for name in shown:
            if name not in ("versions", "peak_bytes"):
                same(said[name], shown[name])
    elif isinstance(shown, str):
        assert said == shown
    else:
        assert np.asarray(said).dtype == np.asarray(shown).dtype
        np.testing.assert_allclose(said, shown, rtol=1e-12)


def test_the_guide_shows_what_is_said(heard: list[tuple[str, Any]]) -> None:
    foreign = Foreign(MINE, "mine", Bar(n=2, sensors=[1]))
    p = np.zeros(2)
    assert foreign.value(p, Solver()) == foreign.gradient(p, Solver()).J
    foreign.peer.close()
    (told, _) = transcripts()
    assert [who for who, _ in heard] == [who for who, _ in told]
    for (_, said), (_, shown) in zip(heard, told, strict=True):
        same(said, shown)


def test_the_guide_shows_how_a_case_is_refused(heard: list[tuple[str, Any]]) -> None:
    with pytest.raises(Unsupported, match=r"mine: load\(\): log E, not raw"):
        Foreign(MINE, "mine", Bar(n=2, sensors=[1], parametrization="raw"))
    (_, told) = transcripts()
    for (who, said), (whose, shown) in zip(heard, told, strict=True):
        assert who == whose
        same(said, shown)


ODD = [0.0, -0.0, 1.5, 5e-324, np.inf, np.nan]


@pytest.mark.parametrize("kind", [np.float64, np.int64])
@pytest.mark.parametrize("shape", [(), (0,), (1,), (6,), (0, 3), (3, 0), (2, 3), (1, 1, 1), (2, 0, 4), (5, 4, 3)])
@pytest.mark.parametrize("framed", [0, 65_536])
def test_arrays_arrive_as_they_were(kind: type, shape: tuple[int, ...], framed: int) -> None:
    values = ODD if kind is np.float64 else [0, -1, 2**63 - 1, -(2**63)]
    array = np.resize(np.array(values, kind), shape)
    limit, protocol.FRAMED = protocol.FRAMED, framed
    try:
        stream = io.BytesIO()
        send(stream, {"a": {"b": [array, 1.5]}, "c": array})
    finally:
        protocol.FRAMED = limit
    stream.seek(0)
    arrived = receive(stream)
    assert arrived["a"]["b"][1] == 1.5
    for one in (arrived["a"]["b"][0], arrived["c"]):
        assert (one.dtype, one.shape) == (array.dtype, array.shape)
        assert one.tobytes() == array.tobytes()
    assert not stream.read()


@pytest.mark.parametrize(
    ("array", "says"),
    [
        ({"float64": [2]}, "an array of shape [2] with float64: give base64 or frame"),
        ({"float64": 2, "base64": ""}, "an array of shape 2 with"),
        ({"float64": [-1], "base64": ""}, "an array of shape [-1] with"),
        ({"float64": [2.0], "base64": ""}, "an array of shape [2.0] with"),
        ({"float64": [1], "base64": 3}, "an array that is no base64"),
        ({"float64": [1], "base64": "AAAA"}, "3 bytes for an array of shape [1], which has 8"),
        ({"float64": [1], "frame": 9}, "a frame of 9 bytes for an array of shape [1], which has 8"),
        ({"float64": [1], "frame": 8}, "0 bytes for an array of shape [1], which has 8"),
        ({"float64": [10**12], "frame": 8 * 10**12}, "a frame of 8000000000000 bytes"),
    ],
)
def test_an_array_that_is_none_is_no_message(array: Any, says: str) -> None:
    with pytest.raises(NoMessage, match=re.escape(says)):
        receive(io.BytesIO(json.dumps({"result": array}).encode() + b"\n"))


@pytest.mark.parametrize("line", [b"\xff\xfe\n", b"[" * 100_000 + b"\n", b"1" * 5000 + b"\n", b"\n", b"null\n"])
def test_a_line_that_is_no_object_is_no_message(line: bytes) -> None:
    with pytest.raises(NoMessage, match="it wrote"):
        receive(io.BytesIO(line))


def test_the_end_is_the_end() -> None:
    with pytest.raises(Ended):
        receive(io.BytesIO())


def test_the_side_for_python_gives_numbers_of_arrays_without_shape_and_no_complex_ones() -> None:
    code = (
        "import numpy as np; from routes_adapter import serve, Singular\n"
        "class It:\n"
        "    def load(self, case): return {}\n"
        "    def value(self, p): return np.array(2.0)\n"
        "    def gradient(self, p, **options):\n"
        "        if len(p) == 1: raise Singular('K')\n"
        "        return {'J': np.float64(1), 'gradient': p + 1j}\n"
        "serve(It(), 'it')"
    )
    start = f"import sys; sys.path.insert(0, {str(ADAPTERS / 'python')!r}); exec({code!r})"
    it = peer.Peer([sys.executable, "-c", start], "it")
    assert it.ask("value", p=np.zeros(1)) == {"J": 2.0}
    with pytest.raises(peer.AdapterError, match=r"TypeError: an array of complex128 - give real numbers"):
        it.ask("gradient", p=np.zeros(2))
    with pytest.raises(SingularMatrix, match=r"^it: gradient\(\): K$"):
        it.ask("gradient", p=np.zeros(1))
    with pytest.raises(peer.AdapterError, match="no attribute 'hessian'"):
        it.ask("hessian")
    it.close()
