"""Our problems over UM-Bridge: right, refused before they are called, and ended by one line."""

from __future__ import annotations

import http.client
import json
import re
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from commands import Shell, ended

from gradient_routes.bench.cases import case
from gradient_routes.bench.protocols.served import Served, models
from gradient_routes.bench.protocols.server import Offered, Refused, Server
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.problem import Array, Parameters
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.sensitivity import sensitivities

BAR = Bar(n=4, alpha=0.3)
P = np.array([0.1, -0.2, 0.3, 0.05])


@contextmanager
def serving(selector: str) -> Iterator[str]:
    (route,) = case.routes([selector])
    with Server("127.0.0.1", 0, Offered(models(BAR, route, Solver()), BAR.parameters, "bar")) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        yield server.url
        server.shutdown()
        thread.join()


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with serving("adjoint") as address:
        yield address


def asked(url: str, endpoint: str, body: bytes, **headers: str) -> tuple[int, Any]:
    connection = http.client.HTTPConnection(url.removeprefix("http://"))
    connection.request("POST", f"/{endpoint}", body, headers)
    answer = connection.getresponse()
    found = answer.status, json.loads(answer.read())
    connection.close()
    return found


@pytest.mark.parametrize("model", ["objective", "observations"])
def test_the_judge_agrees_at_the_start_that_the_server_tells(cli, url: str, model: str) -> None:
    ran = cli("check", f"umbridge:{url}#{model}", "--no-store", "--no-plot")
    assert (ran.code, ran.err) == (0, "")
    assert ran.out.startswith(f"umbridge:{url}#{model}: agrees\n")
    assert re.search(r"^log E_1 +agrees", ran.out, re.MULTILINE)
    (off,) = re.findall(r"^w \. \(dF/dp v\) = \(dF/dp\)\^T w \. v +(\S+)", ran.out, re.MULTILINE)
    assert float(off) < 1e-12  # of a direct solver


def test_a_wrong_route_is_served_as_wrong_and_found(cli) -> None:
    with serving("faulty-adjoint[fault=sign]") as url:
        ran = cli("check", f"umbridge:{url}#objective", "--no-store", "--no-plot")
    assert ran.code == 1
    assert "the whole gradient are off by its sign" in ran.out


def test_the_client_of_umbridge_gets_our_numbers(url: str) -> None:
    umbridge = pytest.importorskip("umbridge", reason="pip install 'umbridge>=1.2.10'")
    assert umbridge.supported_models(url) == ["objective", "observations"]
    J, S_u = umbridge.HTTPModel(url, "objective"), umbridge.HTTPModel(url, "observations")
    model = Model(BAR, Solver())
    state, m = model.solve(P), len(S_u([P.tolist()])[0])
    assert (J.get_input_sizes(), J.get_output_sizes(), S_u.get_output_sizes()) == ([4], [1], [m])
    assert J([P.tolist()]) == [[state.J]]
    lin = model.linearize(state)
    g = lin.J_p + lin.R_p.T @ model.solve_transposed(state.factors, -lin.J_u)
    np.testing.assert_allclose(J.gradient(0, 0, [P.tolist()], [2.0]), 2.0 * g, rtol=1e-12)
    np.testing.assert_allclose(J.apply_jacobian(0, 0, [P.tolist()], P.tolist()), [g @ P], rtol=1e-12)
    H = sensitivities(model, state).dSu_dp
    w = np.linspace(-1.0, 2.0, m)
    np.testing.assert_allclose(S_u([P.tolist()])[0], state.u[:m], rtol=1e-14)
    np.testing.assert_allclose(S_u.gradient(0, 0, [P.tolist()], w.tolist()), H.T @ w, rtol=1e-12)
    np.testing.assert_allclose(S_u.apply_jacobian(0, 0, [P.tolist()], P.tolist()), H @ P, rtol=1e-12)
    with pytest.raises(Exception, match=r"DomainError: bar: log E_1 = -1e\+308 is outside"):
        J([[-1e308] * 4])


P_1 = [[0.0] * 4]
REFUSED: dict[str, tuple[str, dict[str, Any], int, str]] = {
    "no model": ("Evaluate", {"name": "nope", "input": P_1}, 400, "no model nope - there are objective, observations"),
    "endpoint": ("ApplyHessian", {"name": "objective"}, 404, "no endpoint 'ApplyHessian' - there are Info, ModelInfo"),
    "config": ("Evaluate", {"name": "objective", "input": P_1, "config": {"level": 1}}, 400, "has no config"),
    "blocks": ("Evaluate", {"name": "objective", "input": P_1 * 2}, 400, "input is not a list of one list"),
    "length": ("Evaluate", {"name": "objective", "input": [[0.0] * 3]}, 400, "input 0 is a list of 3, not a list of 4"),
    "null": ("Evaluate", {"name": "objective", "input": [[0.0, None, 0.0, 0.0]]}, 400, "something else than numbers"),
    "nan": ("Evaluate", {"name": "objective", "input": [[0.0, np.nan, 0.0, 0.0]]}, 400, "input 0 is not finite"),
    "huge": ("Evaluate", {"name": "objective", "input": [[0.0, 10**400, 0.0, 0.0]]}, 400, "input 0 is not finite"),
    "index": ("Gradient", {"name": "objective", "input": P_1, "outWrt": 0, "inWrt": 1}, 400, "inWrt is 1 - there is"),
    "sens": (
        "Gradient",
        {"name": "objective", "input": P_1, "outWrt": 0, "inWrt": 0, "sens": [1.0, 2.0]},
        400,
        "sens is a list of 2, not a list of 1 numbers",
    ),
    "vec": (
        "ApplyJacobian",
        {"name": "observations", "input": P_1, "outWrt": 0, "inWrt": 0},
        400,
        "vec is NoneType, not a list of 4 numbers",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_a_wrong_request_is_refused_with_its_reason(url: str, what: str) -> None:
    endpoint, message, status, says = REFUSED[what]
    code, answer = asked(url, endpoint, json.dumps(message).encode())
    assert code == status
    assert says in answer["error"]["message"]


@pytest.mark.parametrize(
    ("p", "status", "says"),
    [
        (-1.0, 400, "black: p_1 = -1 is outside 0 < p_1"),
        (1.0, 500, "black: the result is not finite"),
        (2.0, 500, "black: 50 steps"),
        (3.0, 500, "black: KeyError: 'mesh'"),
    ],
)
def test_a_p_without_a_value_is_an_error_not_a_number(p: float, status: int, says: str) -> None:
    def value(p: Array) -> Array:
        failures = {2.0: NotConverged("black: 50 steps", ()), 3.0: KeyError("mesh")}
        if p[0] in failures:
            raise failures[p[0]]
        return np.array([np.inf])

    model = Served(1, value, lambda p, w: p, lambda p, v: p)
    offered = Offered({"objective": model}, Parameters(np.ones(1), np.ones(1), lower=0.0), "black")
    with pytest.raises(Refused, match=says) as refused:
        offered.answer("Evaluate", {"name": "objective", "input": [[p]]})
    assert refused.value.status == status


def test_what_is_no_request_is_refused(url: str) -> None:
    assert asked(url, "Evaluate", b"{")[0] == 400
    assert asked(url, "Evaluate", b"[]")[0] == 400
    assert asked(url, "Evaluate", b"", **{"Content-Length": "9999999999"})[0] == 413


def test_ctrl_c_ends_the_server_with_one_line(started: Shell) -> None:
    server = started.start("serve", "--problem=bar", "--port=0")
    assert server.stdout is not None
    assert "bar, 8 parameters: objective (1), observations (5) at http://127.0.0.1:" in server.stdout.readline()
    server.send_signal(signal.SIGINT)
    ran = ended(server)
    assert (ran.code, ran.err) == (130, "routes: interrupted - 0 evaluations, gradients and products answered\n")


def test_a_port_in_use_and_a_wrong_host_say_so(cli) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        ran = cli("serve", "--problem=bar", f"--port={taken.getsockname()[1]}")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert ": Address already in use - give another --port or --host" in ran.err
    assert "Name or service not known" in cli("serve", "--problem=bar", "--host=nowhere.invalid").err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ["--problem=black.py:Black"],
            "serve: adjoint needs the partial derivatives R_p, J_u, J_p, which black does not",
        ),
        (["--problem=bar", "--route=adjint"], "did you mean 'adjoint'"),
        (["--problem=bar[n=2|3]"], "names 2 problems - name one"),
        (["--problem=bar", "--port=70000"], "--port 70000 - give a whole number from 0 to 65535"),
    ],
)
def test_what_cannot_be_served_says_so(cli, tmp_path, arguments: list[str], says: str) -> None:
    (tmp_path / "black.py").write_text(
        "import numpy as np\nfrom gradient_routes import Parameters, Problem\n\n\nclass Black(Problem):\n"
        "    name = 'black'\n\n    def __init__(self):\n"
        "        self.parameters = Parameters(start=np.ones(2), scale=np.ones(2))\n\n"
        "    def value(self, p):\n        return float(p @ p)\n"
    )
    ran = cli("serve", *arguments)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err
