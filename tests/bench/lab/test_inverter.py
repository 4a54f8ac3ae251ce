"""The bar inverter: a state is a command, its rows are what is drawn, and what the page shows is what they say."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from commands import Ran
from playwright.sync_api import Page, expect

from gradient_routes.bench.lab import inverted
from gradient_routes.bench.lab.inverter_figures import LEFT
from gradient_routes.bench.lab.numbers import number
from gradient_routes.bench.lab.parts.inverter import DRAWS, MOST, Inverter, N
from gradient_routes.bench.lab.place import Place
from gradient_routes.bench.lab.pool import Pool

Cli = Callable[..., Ran]
NODES = 0.35, N + 1.05  # the ends of the axis on which node i is at i + 1/2


def inverter(**query: str) -> Inverter:
    pools = [cast(Pool, None)] * 2
    return Inverter(Place(*pools, Path("/")), query)


@pytest.mark.parametrize(
    ("query", "command"),
    [
        ({}, "--problem 'bar[sensors=1,3,5,noise=0.001]' --optimizer lbfgs --iterations 200"),
        ({"noise": "0", "sensors": "none"}, "--problem 'bar[sensors=0]' --optimizer lbfgs --iterations 200"),
        (
            {"alpha": "1e-6", "seed": "3", "sensors": "8,2", "optimizer": "gauss-newton", "iterations": "0"},
            "--problem 'bar[sensors=2,8,noise=0.001,seed=3,alpha=1e-06]' --optimizer gauss-newton --iterations 0",
        ),
        (
            {"stop_at": "penalty", "gap": "0.9"},
            "--problem 'bar[sensors=1,3,5,noise=0.001,stop=penalty,gap=0.9]' --optimizer lbfgs --iterations 200",
        ),
        (
            {"draws": "7", "alpha": "1e-3"},
            "--problem 'bar[sensors=1,3,5,noise=0.001]' --optimizer gauss-newton --alpha-sweep 1e-8 1 9 --draws 7"
            " --tolerance 1e-6",
        ),
    ],
)
def test_a_state_is_a_command(query: dict[str, str], command: str) -> None:
    part = inverter(**query)
    assert shlex.join(part.command()) == f"invert {command}"
    assert inverter(**dict(pair.split("=") for pair in part.query().split("&") if pair)).command() == part.command()


def rows(cli: Cli, *command: str) -> dict[str, list[dict[str, Any]]]:
    found: dict[str, list[dict[str, Any]]] = {}
    ran = cli(*command, "--json", "--no-store", "--no-isolate")
    assert ran.err == ""
    for row in ran.rows:
        found.setdefault(row["table"], []).append(row)
    return found


def test_columns_are_those_of_the_rows(cli: Cli) -> None:
    """The product of the strains is dJ/d log E less the share of Phi; blind is what the command calls so."""
    found = rows(cli, *inverter(alpha="1e-3", iterations="3").command())
    estimates, steps = found["estimates"], found["inversion"]
    columns = inverted.elements(estimates)
    E, u, lam = (np.array(columns[name]) for name in ("E", "strain", "adjoint_strain"))
    np.testing.assert_allclose(columns["product"], E * u * lam / N, rtol=1e-14)
    x = np.array(columns["estimate"])
    by_phi = 1e-3 * (np.diff(x, prepend=x[0]) - np.diff(x, append=x[-1]))
    np.testing.assert_allclose(np.array(columns["product"]) + by_phi, columns["gradient"], rtol=1e-9, atol=1e-15)
    assert inverted.blind(estimates) == {"left": [5.5, 6.5, 7.5], "right": [6.5, 7.5, 8.5]}
    assert inverted.bars(estimates, None)["e"] == []
    assert inverted.path(steps)["solves"] == [row["forward_solves"] + row["adjoint_solves"] for row in steps]
    assert inverted.path([steps[0] | {"misfit": 0.0}])["misfit"] == []


def test_the_tail_is_seen_through_the_stop(cli: Cli) -> None:
    touched = rows(cli, *inverter(stop_at="penalty", iterations="0").command())["estimates"]
    assert inverted.blind(touched)["left"] == []
    assert all(row["gradient"] for row in touched)


def test_the_spread_is_that_of_the_closest_weight() -> None:
    trades = [{"alpha": alpha, "mean": [alpha, 2.0], "sd": [0.5, 0.25]} for alpha in (1.0, 1e-4, 1e-8)]
    assert [inverted.nearest(trades, alpha) for alpha in (0.0, 2e-4, 30.0)] == [trades[2], trades[1], trades[0]]
    assert inverted.nearest([], 0.0) is None
    assert inverted.bars([], trades[0]) == {"e": [1, 2], "centre": [1.0, 2.0], "low": [0.5, 1.75], "high": [1.5, 2.25]}


def agrees(page: Page, cli: Cli, contains: str) -> list[dict[str, Any]]:
    """Rows of the command that is shown: it has these words, and table, meter and verdict are what it says."""
    shown = page.locator(".command code")
    expect(shown).to_contain_text(contains)
    found = rows(cli, *shlex.split(shown.text_content() or "")[1:])
    last, estimates = found["inversion"][-1], found["estimates"]
    for column, name in ((2, "truth"), (3, "estimate"), (4, "gradient")):
        cells = page.get_by_role("table").locator(f"tbody tr :nth-child({column})")
        expect(cells).to_have_text([number(row[name]) for row in estimates])
    meter = [str(last["forward_solves"]), str(last["adjoint_solves"]), f"{last['ending_solves']} forward"]
    expect(page.locator("dd").nth(2)).to_have_text(meter[2])
    assert page.locator("dd").all_text_contents()[:4] == [*meter, str(last["iteration"])]
    expect(page.get_by_text(last["says"])).to_be_visible()
    return estimates


def test_every_control_is_the_command_that_is_shown(page: Page, laboratory: str, cli: Cli) -> None:
    page.set_viewport_size({"width": 390, "height": 700})  # of a phone
    page.goto(f"{laboratory}/inverter?iterations=2&noise=0.01")
    agrees(page, cli, "bar[sensors=1,3,5,noise=0.01]")
    figure = page.locator(".bk-events").first
    box = figure.bounding_box()
    assert box is not None
    part = (7.5 - NODES[0]) / (NODES[1] - NODES[0])
    figure.click(position={"x": LEFT + part * (box["width"] - LEFT), "y": box["height"] / 2.0})
    assert not agrees(page, cli, "sensors=1,3,5,7,")[6]["blind"]
    page.get_by_role("button", name="7", exact=True).press("Enter")
    assert agrees(page, cli, "sensors=1,3,5,noise")[6]["blind"]
    for handle, words in ((0, "noise=0.02"), (1, "alpha=1e-09")):
        page.locator(".noUi-handle").nth(handle).press("ArrowRight")
        agrees(page, cli, words)
    page.get_by_label("Optimizer").select_option("gauss-newton")
    agrees(page, cli, "--optimizer gauss-newton --iterations 2")
    for button, k in (("step", 3), ("step back", 2), ("run", MOST), ("reset", 0)):
        page.get_by_role("button", name=button, exact=True).click()
        agrees(page, cli, f"--iterations {k}")
    page.get_by_label("Stop beyond the tip").select_option("penalty")
    assert not any(row["blind"] for row in agrees(page, cli, "stop=penalty,gap=0.8"))
    address = page.url
    page.goto("about:blank")
    page.goto(address)
    agrees(page, cli, "noise=0.02,alpha=1e-09,stop=penalty,gap=0.8]' --optimizer gauss-newton --iterations 0")


def test_noise_is_redrawn_until_something_changes(page: Page, laboratory: str, cli: Cli) -> None:
    page.set_viewport_size({"width": 390, "height": 700})
    page.goto(f"{laboratory}/inverter?iterations=1&noise=0.01&sensors=1&draws=2&alpha=1e-8")
    shown = page.locator(".command code")
    expect(shown).to_contain_text("--draws 2")
    trade = rows(cli, *shlex.split(shown.text_content() or "")[1:])["tradeoff"][-1]
    for column, name in ((8, "mean"), (9, "sd")):
        cells = page.get_by_role("table").locator(f"tbody tr :nth-child({column})")
        expect(cells).to_have_text([number(v) for v in trade[name]])
    page.get_by_role("button", name=f"redraw the noise {DRAWS} times").click()
    expect(shown).to_contain_text(f"--draws {DRAWS}")
    expect(page.get_by_role("heading", name=f"The same with {DRAWS} draws")).to_be_visible()
    page.get_by_role("button", name="reset").click()
    agrees(page, cli, "--iterations 0")


def test_back_shows_the_state_of_the_address(page: Page, laboratory: str) -> None:
    page.goto(f"{laboratory}/inverter?sensors=2")
    page.get_by_role("button", name="7", exact=True).click()
    expect(page.locator("code").last).to_contain_text("sensors=2,7")
    page.wait_for_url("**/inverter?sensors=2,7")
    page.go_back()
    expect(page.locator("code").last).to_contain_text("bar[sensors=2,noise")
