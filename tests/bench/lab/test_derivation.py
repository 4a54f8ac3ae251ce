"""The derivation of the adjoint: what the page shows is what `routes run` computes."""

from __future__ import annotations

import shlex
from collections.abc import Callable

from commands import Ran
from playwright.sync_api import Page, expect

from gradient_routes.bench.lab.numbers import number


def test_a_moved_modulus_and_a_sensor_move_every_number(page: Page, laboratory: str, cli: Callable[..., Ran]) -> None:
    page.goto(f"{laboratory}/derivation")
    first = page.locator("td").first
    expect(first).to_have_text("0.125")
    page.locator(".noUi-handle").nth(1).focus()
    expect(page.get_by_role("slider", name="E_2")).to_be_focused()  # a name for screen readers
    page.keyboard.press("ArrowRight")
    expect(page.locator("code").last).to_contain_text("--at")
    command = shlex.split(page.locator("code").last.text_content() or "")
    row = cli(*command[1:], "--json", "--no-store").rows[-1]
    shown = page.get_by_role("table").last.locator("td:last-child")
    expect(shown).to_have_text([number(g, 6) for g in row["gradient"]])
