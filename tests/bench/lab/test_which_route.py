"""The guided choice: what the page shows is what `routes advise` computes."""

from __future__ import annotations

import shlex
from collections.abc import Callable

from commands import Ran
from playwright.sync_api import Page, expect

from gradient_routes.bench.render.format import ratio
from gradient_routes.bench.units import duration


def test_answers_change_the_bills_and_what_would_change_them(
    page: Page, laboratory: str, cli: Callable[..., Ran]
) -> None:
    page.goto(f"{laboratory}/which-route?forward=20")
    expect(page.locator("h2").first).to_contain_text("adjoint")
    parameters = page.get_by_label("Parameters n_p")
    parameters.fill("3")
    parameters.press("Enter")
    outputs = page.get_by_label("Outputs")
    outputs.fill("40")
    outputs.press("Enter")
    expect(page.locator("h2").first).to_contain_text("tangent")
    command = shlex.split(page.locator("code").last.text_content() or "")
    assert command == ["routes", "advise", "--parameters", "3", "--outputs", "40", "--forward", "20"]
    (advice,) = cli(*command[1:], "--json").rows
    possible = [row for row in advice["routes"] if row["possible"]]
    shown = page.get_by_role("table").first
    expect(shown.locator("td:nth-child(3)")).to_have_text([duration(row["seconds"]) for row in possible])
    expect(shown.locator("td:nth-child(4)")).to_have_text([ratio(row["forward_ratio"]) for row in possible])
    change = next(each for each in advice["changes"] if each["answer"] == "n_p")
    page.get_by_role("link", name=change["says"]).click()
    expect(page.locator("h2").first).to_contain_text(change["route"])
    expect(page.get_by_label("Parameters n_p")).to_have_value(str(change["value"]))
