"""Tesseracts as the subject of a check, from their source and over HTTP: right, wrong, without values."""

from __future__ import annotations

import json
import re
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from gradient_routes.bench.protocols import tesseract
from gradient_routes.bench.protocols.pytree import decoded, leaves, replaced

SPRINGS = Path(__file__).parent / "springs_tesseract.py"
PIP = "pip install 'gradient-routes[tesseract]'"
INPUTS = {"inputs": {"groups": [{"E": [2.1e11, 0.7e11]}, {"E": [1.1e11]}], "load": {"tip": 2e4}}}
ENDPOINTS = ("vector_jacobian_product", "jacobian_vector_product", "jacobian")


def source(folder: Path, fault: str = "none", without: tuple[str, ...] = ()) -> Path:
    """A folder with a Tesseract, and inputs.json."""
    pytest.importorskip("tesseract_core.runtime", reason=PIP)
    text = SPRINGS.read_text().replace('FAULT = "none"', f'FAULT = "{fault}"')
    for endpoint in without:
        text = text.replace(f"def {endpoint}(", f"def no_{endpoint}(")
    (folder / "springs").mkdir()
    (folder / "springs" / "tesseract_api.py").write_text(text)
    (folder / "inputs.json").write_text(json.dumps(INPUTS))
    return folder / "springs"


def check(cli, target: object, *more: str):
    return cli("check", f"tesseract:{target}", "--config=inputs.json", "--budget=60", "--no-store", "--json", *more)


@pytest.mark.parametrize(
    ("without", "compared"),
    [((), True), (ENDPOINTS[:2], False), (ENDPOINTS[::2], False), (ENDPOINTS[1:2], True)],
    ids=["all", "jacobian", "jvp", "vjp and jacobian"],
)
def test_a_right_gradient_agrees_by_whatever_it_has(cli, tmp_path: Path, without: tuple[str, ...], compared: bool):
    ran = check(cli, source(tmp_path, without=without))
    found = json.loads(ran.out)
    assert (ran.code, ran.err, found["verdict"]) == (0, "", "agrees")
    assert [f["sound"] for f in found["findings"] if "dF/dp v" in f["name"]] == [True] * compared


def test_a_flipped_sign_of_a_stiff_modulus_is_found(cli, tmp_path: Path) -> None:
    """tesseract-runtime check-gradients passes it: findings/tesseract-flipped-signs.sh."""
    found = json.loads(check(cli, source(tmp_path, "sign"), "--budget=240").out)
    assert (found["verdict"], found["culprit"]) == ("wrong-gradient", "component groups.[0].E_2, off by its sign")


def test_other_inputs_and_data_can_be_given(cli, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("p\n1e11\n2e11\n3e11\n1e4\n")
    (tmp_path / "d.csv").write_text("d\n1e-7\n1e-7\n2e-7\n2e-7\n")
    found = json.loads(check(cli, source(tmp_path), "--at=p.csv", "--data=d.csv").out)
    assert found["verdict"] == "agrees"


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ("nan", "J cannot be evaluated at p: NoValue: apply: ends.u is nan in 3 of 3 components"),
        ("raises", "the gradient raises NoValue: vector_jacobian_product: the adjoint has not converged"),
    ],
)
def test_no_value_is_said_as_the_model_says_it(cli, tmp_path: Path, fault: str, says: str) -> None:
    ran = check(cli, source(tmp_path, fault))
    found = json.loads(ran.out)
    assert (ran.code, found["verdict"], found["says"]) == (3, "undetermined", says)


def test_a_served_one_is_judged_over_http(cli, tmp_path: Path) -> None:
    folder = source(tmp_path)
    import uvicorn
    from tesseract_core.runtime.core import load_module_from_path
    from tesseract_core.runtime.serve import create_rest_api

    app = create_rest_api(load_module_from_path(folder / "tesseract_api.py"))
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_level="critical"))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    (socket,) = server.servers[0].sockets
    found = json.loads(check(cli, f"http://127.0.0.1:{socket.getsockname()[1]}").out)
    server.should_exit = True
    thread.join()
    assert found["verdict"] == "agrees"


@pytest.mark.parametrize(
    ("target", "more", "says"),
    [
        ("springs", (), 'no inputs - give --config FILE.json, the payload of apply, {"inputs": {..}}'),
        (
            "springs",
            ("--config=bare.json",),
            'no inputs - give --config FILE.json, the payload of apply, {"inputs": {..}}',
        ),
        ("springs", ("--config=none.json",), "no differentiable input, groups.[].E load.{}, is given - give one"),
        (
            "springs",
            ("--config=text.json",),
            "an array of the inputs cannot be read: could not convert string to float",
        ),
        ("springs", ("--config=inputs.json", "--at=p.csv"), "p has 2 values, n_p = 4 - give 4"),
        ("springs", ("--config=inputs.json", "--data=p.csv"), "2 data, F(p) has m = 4 - give 4"),
        ("nowhere", (), "no file nowhere there - give a tesseract_api.py, its folder, or http://HOST:PORT"),
        ("broken.py", (), "cannot be loaded: ModuleNotFoundError: No module named 'nothing_here' - mend it"),
        ("http://127.0.0.1:9", (), "http://127.0.0.1:9: no answer to health: Connection refused - is the server"),
    ],
)
def test_what_cannot_be_checked_says_so(cli, tmp_path: Path, target: str, more: tuple[str, ...], says: str) -> None:
    source(tmp_path)
    (tmp_path / "bare.json").write_text(json.dumps(INPUTS["inputs"]))
    (tmp_path / "none.json").write_text('{"inputs": {"groups": []}}')
    (tmp_path / "text.json").write_text('{"inputs": {"groups": [{"E": ["stiff"]}]}}')
    (tmp_path / "p.csv").write_text("p\n1.0\n2.0\n")
    (tmp_path / "broken.py").write_text("import nothing_here\n")
    ran = cli("check", f"tesseract:{target}", "--no-store", *more)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err


def test_one_without_derivatives_says_what_is_needed(cli, tmp_path: Path) -> None:
    ran = check(cli, source(tmp_path, without=ENDPOINTS))
    assert ran.code == 2
    assert "has no derivatives - a check needs vector_jacobian_product, jacobian or jacobian_vector_product" in ran.err


def test_one_that_does_not_tell_what_is_differentiable_says_so(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tesseract, "_opened", lambda *_: SimpleNamespace(openapi_schema={"paths": {}}))
    ran = cli("check", "tesseract:http://old")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "does not tell what is differentiable - build it with tesseract-core 1.15" in ran.err


def test_a_missing_package_is_one_line_with_the_command(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "tesseract_core", None)
    ran = cli("check", "tesseract:springs")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert re.search(re.escape(PIP), ran.err)


# --- arrays inside nested objects


def test_arrays_are_found_by_the_paths_of_tesseract_and_replaced() -> None:
    tree = {"parts": [{"E": [1.0, 2.0]}, {"E": None}, {}], "by": {"a.b": 3.0, "c}": [[4.0]]}}
    found = [leaf for pattern in ("parts.[].E", "by.{}", "absent") for leaf in leaves(pattern, tree)]
    assert [leaf.path for leaf in found] == ["parts.[0].E", "by.{a.b}", r"by.{c\}}"]
    assert [[*leaf.components()] for leaf in found] == [
        ["parts.[0].E_1", "parts.[0].E_2"],
        ["by.{a.b}"],
        [r"by.{c\}}_1_1"],
    ]
    other = replaced(tree, [(found[0].keys, np.zeros(2)), (found[1].keys, np.ones(()))])
    assert other["parts"][0]["E"].tolist() == [0.0, 0.0]
    assert other["by"]["a.b"] == 1.0


def test_encoded_arrays_are_read() -> None:
    json_array = {
        "object_type": "array",
        "shape": [1, 2],
        "dtype": "float64",
        "data": {"encoding": "json", "buffer": [[1, 2]]},
    }
    base64_array = json_array | {"data": {"encoding": "base64", "buffer": "AAAAAAAA8D8AAAAAAAAAQA=="}}
    for array in (json_array, base64_array):
        assert decoded({"a": [array]})["a"][0].tolist() == [[1.0, 2.0]]
    with pytest.raises(ValueError, match="encoding binref: give json or base64"):
        decoded(json_array | {"data": {"encoding": "binref", "buffer": "x"}})
