"""The laboratory as a user has it: `routes lab` in a process of its own, Chromium without a window."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from commands import ROOT
from playwright.sync_api import Browser, Page, expect, sync_playwright

from benchmarks.invented_store import fill
from gradient_routes.bench.store.store import Store

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
PATIENCE = 60_000  # [ms] for what takes a tenth of a second on an idle machine

expect.set_options(timeout=PATIENCE)


@pytest.fixture(scope="session")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The store that it shows."""
    path = tmp_path_factory.mktemp("store") / "kept.sqlite"
    fill(Store(path), 240)
    return path


@pytest.fixture(scope="session")
def laboratory(kept: Path) -> Iterator[str]:
    """Its address."""
    command = [sys.executable, "-m", "gradient_routes", "lab", "--no-browser", "--port", "0", "--store", str(kept)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=os.environ) as served:
        assert served.stdout is not None
        yield served.stdout.readline().split()[0].rstrip("/")
        served.send_signal(signal.SIGINT)
        served.wait()


@pytest.fixture(scope="module")  # Playwright runs a loop, beside which tests of other modules could run none
def browser() -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("no Chromium here - apt-get install chromium")
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """An empty page that goes nowhere but to this machine; an error of a script fails the test."""
    errors: list[str] = []
    outside: list[str] = []
    context = browser.new_context()
    context.set_default_timeout(PATIENCE)
    opened = context.new_page()
    opened.on("pageerror", lambda error: errors.append(str(error)))
    opened.on("request", lambda asked: None if is_local(asked.url) else outside.append(asked.url))
    yield opened
    context.close()
    assert not errors
    assert not outside


def is_local(url: str) -> bool:
    return url.startswith(("http://127.0.0.1:", "ws://127.0.0.1:", "blob:", "data:"))
