"""Models behind UM-Bridge as the subject of a check: right, wrong, without values, and what is no such model."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from umbridge_models import NO_VALUE, serving

P = "p\n1.0\n2.0\n3.0\n0.5\n0.7\n"


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with serving() as address:
        yield address


@pytest.fixture
def check(cli, url: str, tmp_path: Path):
    (tmp_path / "p.csv").write_text(P)
    return lambda model, *more: cli("check", f"umbridge:{url}#{model}", "--at=p.csv", "--no-store", "--json", *more)


@pytest.mark.parametrize("more", [(), ("--data=d.csv",), ("--config=c.json",)], ids=["weighted", "misfit", "config"])
def test_a_right_gradient_agrees(check, more: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text("d\n0.5\n0.2\n9.0\n")
    (tmp_path / "c.json").write_text('{"level": 2}')
    ran = check("right", *more)
    found = json.loads(ran.out)
    assert (ran.code, found["verdict"]) == (0, "agrees")
    (products,) = [f for f in found["findings"] if "dF/dp v" in f["name"]]
    assert products["sound"]


def test_a_flipped_sign_is_found_also_beside_its_jacobian(check) -> None:
    found = json.loads(check("sign").out)
    assert (found["verdict"], found["culprit"]) == ("wrong-gradient", "component p_1_2, off by its sign")
    (products,) = [f for f in found["findings"] if "dF/dp v" in f["name"]]
    assert not products["sound"]


def test_a_wrong_product_beside_a_right_gradient_is_said(check) -> None:
    found = json.loads(check("product").out)
    assert found["verdict"] == "agrees"
    assert "but w . (dF/dp v) = (dF/dp)^T w . v: " in found["says"]
    assert found["next"] == "look at w . (dF/dp v) = (dF/dp)^T w . v"


def test_products_with_the_jacobian_are_a_gradient(check) -> None:
    assert json.loads(check("forward").out)["verdict"] == "agrees"


@pytest.mark.parametrize("model", NO_VALUE)
def test_no_value_is_said_as_the_model_says_it(check, model: str) -> None:
    ran = check(model)
    found = json.loads(ran.out)
    assert (ran.code, found["verdict"]) == (3, "undetermined")
    assert found["says"] == f"J cannot be evaluated at p: NoValue: {NO_VALUE[model]}"


@pytest.mark.parametrize(
    ("target", "more", "says"),
    [
        ("#nope", (), "no model 'nope' - there are right, sign, product, forward, values,"),
        ("", (), "13 models - there are right, sign,"),
        (
            "#values",
            (),
            "#values: offers Evaluate - a check needs Evaluate and Gradient, or ApplyJacobian in its place",
        ),
        ("#right", (), "#right: has no start - give the point, 5 values, with --at FILE.csv"),
        ("#right", ("--at=short.csv",), "#right: p has 2 values, n_p = 5 - give 5"),
        ("#right", ("--at=p.csv", "--data=short.csv"), "#right: 2 data, F(p) has m = 3 - give 3"),
        ("#right", ("--at=p.csv", "--config=p.csv"), "p.csv: is no JSON: Expecting value"),
        ("#right", ("--at=p.csv", "--config=list.json"), "list.json: is no JSON object"),
        ("#right", ("--at=p.csv", "--config=none.json"), "none.json: cannot be read: No such file or directory"),
        ("#right", ("--at=true",), "--at true is for registered problems"),
        ("/next#right", (), "/next: speaks version 2.0 of UM-Bridge, this is 1.0 - renew the server"),
        ("/elsewhere#right", (), "is it a server of UM-Bridge?"),
    ],
)
def test_what_cannot_be_checked_says_so(
    cli, url: str, tmp_path: Path, target: str, more: tuple[str, ...], says: str
) -> None:
    (tmp_path / "p.csv").write_text(P)
    (tmp_path / "short.csv").write_text("p\n1.0\n2.0\n")
    (tmp_path / "list.json").write_text("[]")
    ran = cli("check", f"umbridge:{url}{target}", "--no-store", *more)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err


@pytest.mark.parametrize(
    ("address", "says"),
    [
        ("http://127.0.0.1:9#m", "http://127.0.0.1:9: no answer to Info: Connection refused - is the server running"),
        ("127.0.0.1:9#m", "127.0.0.1:9: is no address of a server - give http://HOST:PORT"),
        ("http://127.0.0.1:99999#m", "Port out of range 0-65535 - give http://HOST:PORT"),
    ],
)
def test_an_address_without_a_server_says_so(cli, address: str, says: str) -> None:
    ran = cli("check", f"umbridge:{address}", "--no-store")
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err


def test_options_of_models_are_refused_elsewhere(cli) -> None:
    ran = cli("check", "--problem=bar", "--route=adjoint", "--config=c.json")
    assert (ran.code, ran.err) == (2, "routes: --config: is for models of UM-Bridge and Tesseract - leave it out\n")
