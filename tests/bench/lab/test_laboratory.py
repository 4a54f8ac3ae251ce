"""Routes on problems: a state is one command; the page shows what that command computes; bad input is one line."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import pytest
from commands import Ran
from playwright.sync_api import Page, expect

from gradient_routes.bench.lab import chosen
from gradient_routes.bench.lab.numbers import number
from gradient_routes.bench.lab.parts.laboratory import Laboratory
from gradient_routes.bench.lab.place import Place
from gradient_routes.bench.lab.pool import Pool
from gradient_routes.bench.lab.results.bill import Bill, work
from gradient_routes.bench.lab.results.kink import joined, slopes
from gradient_routes.bench.lab.results.vcurve import lines
from gradient_routes.bench.studies.kink.figures import said
from gradient_routes.bench.studies.unrolling.figures import says
from gradient_routes.problems.errors import InputError


def of(**query: str) -> Laboratory:
    nowhere = cast(Pool, None)
    return Laboratory(Place(nowhere, nowhere, Path("/")), query)


@pytest.mark.parametrize(
    ("state", "command"),
    [
        (
            {"routes": "fd-central,unrolled-ad", "step": "1e-5", "iterations": "4", "rtol": "1e-2"},
            "run --problem bar --route 'fd-central[step=1e-5]' --route 'unrolled-ad[iterations=4]' --rtol 1e-2"
            " --gradient --no-timing",
        ),
        (
            {"problem": "block", "options": "law=linear", "routes": "all,adjoint,faulty-adjoint", "fault": "factor"},
            "run --problem 'block[n=2,law=linear]' --route all --route 'faulty-adjoint[fault=factor]'"
            " --gradient --no-timing",
        ),
        (
            {"mode": "vcurve", "judged": "faulty-adjoint", "options": "n=4"},
            "vcurve --problem 'bar[n=4]' --route 'faulty-adjoint[fault=sign]'",
        ),
        (
            {"mode": "kink", "routes": "adjoint", "tip_stop": "multiplier"},
            "kink --problem 'bar[stop=multiplier]' --route adjoint --points 17",
        ),
        ({"mode": "unrolling", "inner": "jacobi"}, "unrolling --problem bar --inner jacobi"),
    ],
)
def test_a_state_is_a_command(state: dict[str, str], command: str) -> None:
    part = of(**state)
    assert shlex.join(part.command()) == command
    assert (
        of(**dict(pair.split("=", 1) for pair in part.query().replace("%3D", "=").split("&"))).command()
        == part.command()
    )


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ({"options": "m=3"}, "no option 'm'"),
        ({"options": "n"}, "'n' has no '='"),
        ({"options": "n=8|16"}, "one value at a time"),
        ({"options": "data=readings.csv"}, "data= names a file"),
        ({"problem": "block", "options": "mesh=a.msh"}, "mesh= names a file"),
        ({"options": "phi=../../etc/passwd"}, "takes no paths"),
        ({"options": "phi=a\\b"}, "takes no paths"),
        ({"options": "n=eight"}, "n=eight is not a whole number"),
        ({"routes": "adjoin"}, "did you mean 'adjoint'?"),
        ({"routes": "/tmp/mine.py:route"}, "no route"),
        ({"routes": "adapter"}, "command"),
        ({"routes": ""}, "no route is chosen"),
        ({"mode": "kink", "options": "stop=penalty"}, "has a field of its own"),
        ({"mode": "vcurve", "judged": "mine.py:route"}, "no route"),
    ],
)
def test_what_names_nothing_registered_is_refused_in_one_line(state: dict[str, str], words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)) as refused:
        of(**state).command()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("state", [{"step": "0"}, {"problem": "mine.py:P"}, {"rtol": "nan"}, {"fault": "none"}])
def test_what_is_no_choice_leaves_the_state_as_it_is(state: dict[str, str]) -> None:
    part = of(**state)
    assert part.query() == ""
    assert next(iter(state)) in str(part.status.object)


def test_controls_are_those_that_matter() -> None:
    part = of(mode="vcurve", judged="faulty-adjoint")
    part.content()
    assert {name for name, control in part._controls.items() if control.visible} == {
        "mode", "problem", "options", "judged", "fault", "rtol", "linear_solver"
    }  # fmt: skip
    part.judged = "fd-central"
    assert part._controls["step"].visible
    assert not part._controls["fault"].visible
    assert "press Run" in str(part.status.object)


def test_routes_that_apply_are_offered() -> None:
    own, others = chosen.applying("bar")
    assert {"fd-central", "complex-step", "adjoint", "implicit-ad", "faulty-adjoint"} <= {*own}
    assert "torch" in others
    assert "adapter" not in (*own, *others)  # it runs any program


COUNTED = {"forward_solves": 1, "solves": 9, "newton_iterations": 1, "transposed_solves": 0, "matvecs": 0}
ROW: dict[str, Any] = {
    "route": "tangent", "route_options": {}, "status": "ok", "reason": None, "gradient": [1.0, 0.0], "work": COUNTED,
    "gradient_reference": [2.0, 0.0], "parameters": ["p_1", "p_2"], "units": ["", ""], "gradient_error": 0.5,
    "gradient_error_estimate": None, "peak_bytes": 4096, "tape_bytes": None,
}  # fmt: skip
BROKEN = ROW | {
    "route": "torch", "status": "failed", "reason": "torch: <no>", "gradient": None, "work": None, "parameters": None,
    "gradient_reference": None, "peak_bytes": None, "gradient_error": None,
}  # fmt: skip


def test_a_bill_counts_solves_beside_those_of_newton_and_draws_exact_components_at_the_bottom() -> None:
    assert work(ROW)["linearized_solves"] == 8
    drawn = Bill._columns([ROW, BROKEN])
    assert drawn["error"] == [0.5, 0.0]
    assert drawn["shown"] == [0.5, 1e-18]
    bill = Bill()
    bill.take(BROKEN)
    assert "failed: torch: &lt;no&gt;" in bill.table.object


def test_a_curve_leaves_out_errors_without_a_logarithm() -> None:
    point = {"line": "random direction 1", "tightened": 1.0, "error_one_sided": 1e-3, "error_central": 0.0, "step": 0.1}
    drawn = lines([point, point | {"step": 1.0, "error_central": 0.5}])
    assert drawn["xs"] == [[0.1, 1.0], [1.0]]


def test_nothing_is_drawn_across_a_kink() -> None:
    row = {"route": "adjoint", "active_set": "closed", "s": 2.0, "slope": -1.0}
    found = joined(
        slopes([row | {"active_set": "open"}, row | {"s": 1.0, "slope": 0.0}, row | {"s": 1.5, "slope": None}])
    )
    assert found["xs"] == [[1.0], [2.0]]


def rows_of(page: Page, cli: Callable[..., Ran]) -> list[dict[str, Any]]:
    """Those of the command that the page shows."""
    command = shlex.split(page.locator("code").last.text_content() or "")
    return cli(*command[1:], "--json", "--no-store").rows


def cells(page: Page, column: int) -> list[str]:
    return page.get_by_role("table").first.locator(f"tbody tr > :nth-child({column})").all_text_contents()


def test_errors_and_work_of_routes_are_those_of_the_command(
    page: Page, laboratory: str, cli: Callable[..., Ran]
) -> None:
    page.goto(f"{laboratory}/laboratory?options=n=4&routes=fd-central,adjoint")
    table = page.get_by_role("table").first.locator("tbody tr")
    expect(table).to_have_count(2)
    page.get_by_label("tangent").focus()
    page.keyboard.press("Space")
    expect(table).to_have_count(3)
    expect(page.get_by_role("table").first).to_contain_text("tangent")
    page.locator(".noUi-handle").first.focus()
    page.keyboard.press("ArrowRight")  # the next step: 1e-16
    expect(page.locator("code").last).to_contain_text("fd-central[step=1e-16]")
    expect(page.get_by_role("table").first).to_contain_text("fd-central[step=1e-16]")
    rows = rows_of(page, cli)
    assert [row["status"] for row in rows] == ["ok"] * 3
    expect(table.locator(":nth-child(2)")).to_have_text([number(row["gradient_error"], 2) for row in rows])
    assert cells(page, 4) == [str(row["work"]["forward_solves"]) for row in rows]
    assert rows[0]["gradient_error"] > 1e-3  # a step far too small


def test_the_verdict_is_that_of_the_command_word_for_word(page: Page, laboratory: str, cli: Callable[..., Ran]) -> None:
    page.goto(f"{laboratory}/laboratory?mode=vcurve&judged=faulty-adjoint&fault=factor&options=n=2,sensors=2")
    expect(page.locator("#verdict")).to_be_visible()
    (check,) = rows_of(page, cli)
    assert check["verdict"] == "wrong-gradient"
    expect(page.locator("#verdict")).to_have_text(f"{check['name']}: {check['verdict']}")
    expect(page.locator("#says")).to_have_text(check["says"])
    expect(page.locator("#next")).to_have_text(f"next: {check['next']}")
    expect(page.locator(".verdict")).to_have_class("verdict bad")


def test_a_kink_has_two_slopes(page: Page, laboratory: str, cli: Callable[..., Ran]) -> None:
    page.goto(f"{laboratory}/laboratory?mode=kink&routes=adjoint&options=n=2,sensors=2")
    expect(page.locator("#event")).to_be_visible()
    rows = rows_of(page, cli)
    expect(page.locator("#event")).to_have_text(said(rows[0]))
    sides = [row for row in rows if row["kind"] == "side"]
    assert cells(page, 2) + cells(page, 3) == [number(row["slope"], 6) for row in sides]
    assert not math.isclose(sides[0]["slope"], sides[1]["slope"], rel_tol=0.1)


def test_unrolled_iterations_come_row_by_row(page: Page, laboratory: str, cli: Callable[..., Ran]) -> None:
    page.goto(f"{laboratory}/laboratory?mode=unrolling&options=n=3")
    expect(page.locator("#met")).to_be_visible()
    rows = rows_of(page, cli)
    steps = [row for row in rows if row["table"] == "unrolling"]
    expect(page.locator("#met")).to_have_text(says([row for row in rows if row["table"] == "unrolling_fits"]))
    assert cells(page, 2) == [number(row["gradient_error"], 2) for row in steps]


def test_a_route_that_does_not_apply_says_why_and_a_long_run_is_stopped(page: Page, laboratory: str) -> None:
    page.goto(f"{laboratory}/laboratory?routes=warp&options=n=2")
    expect(page.get_by_role("table").first).to_contain_text("skipped: warp knows hyperelastic, not bar")
    page.goto(f"{laboratory}/laboratory?mode=vcurve&judged=fd-central&options=n=20000")
    stop = page.get_by_role("button", name="Stop")
    expect(stop).to_be_enabled()
    stop.press("Enter")
    expect(page.locator("p[role=status]").first).to_contain_text("stopped")
    expect(stop).to_be_disabled()
    page.get_by_label("Further options of the problem").fill("mesh=/etc/passwd")
    page.keyboard.press("Enter")
    expect(page.locator("p[role=status]").first).to_contain_text("takes no others")
