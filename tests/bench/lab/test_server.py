"""The server: for this machine only, one page apart from the other, and nothing left when it ends."""

from __future__ import annotations

import http.client
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import psutil
import pytest
from commands import PATIENCE, ROOT, Ran
from playwright.sync_api import Browser, expect

from gradient_routes.bench.lab.server import LOOPBACK, UPLOAD

SHORT = """
import gradient_routes.bench.lab.server as server
server.IDLE = 400  # [ms]
from gradient_routes.bench.cli import main
main(["lab", "--no-browser", "--port", "0"])
"""
KEEP_LINE = """
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function(...what) { window.line = this; return send.apply(this, what) };
"""


def asked(laboratory: str, path: str, **headers: str) -> tuple[int, str]:
    """Status and text of an answer."""
    with closing(http.client.HTTPConnection(laboratory.removeprefix("http://"), timeout=PATIENCE)) as connection:
        connection.request("GET", path, headers=headers)
        with connection.getresponse() as answer:
            return answer.status, "" if answer.status == 101 else answer.read().decode("utf-8", "replace")


def upgrade(origin: str) -> dict[str, str]:
    return {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
        "Sec-WebSocket-Protocol": "bokeh, none",
        "Origin": origin,
    }


def test_other_machines_do_not_reach_it(laboratory: str) -> None:
    port = int(laboratory.rpartition(":")[2])
    listening = {c.laddr.ip for c in psutil.net_connections("tcp") if c.laddr.port == port and c.status == "LISTEN"}
    assert listening == {LOOPBACK}


@pytest.mark.parametrize("origin", ["http://evil.example", "http://evil.example:{port}", "null", "http://127.0.0.1:1"])
def test_pages_of_others_do_not_talk_to_it(laboratory: str, origin: str) -> None:
    origin = origin.format(port=laboratory.rpartition(":")[2])
    assert asked(laboratory, "/store/ws", **upgrade(origin))[0] == 403


@pytest.mark.parametrize("path", ["/", "/store", "/static/js/bokeh.min.js", "/store/ws"])
def test_names_of_others_for_this_machine_are_refused(laboratory: str, path: str) -> None:
    port = laboratory.rpartition(":")[2]
    for host in ("evil.example", f"evil.example:{port}", f"127.0.0.1.evil.example:{port}"):
        assert asked(laboratory, path, Host=host)[0] == 403
    assert asked(laboratory, "/", Host=f"localhost:{port}")[0] == 200


@pytest.mark.parametrize(
    "path",
    [
        "/static/",
        "/static/js/",
        "/static/../../../../etc/passwd",
        "/static/%2e%2e/%2e%2e/server.py",
        "/static/js/..%2f..%2fserver.py",
        "/static//etc/passwd",
        "/static/extensions/panel/../../config.py",
        "/components/antigravity/a/b/c",  # Panel would import that module
        "/store/autoload.js?bokeh-autoload-element=1",
        "/results/",
        "/store/../store.py",
    ],
)
def test_no_files_and_no_modules_are_served(laboratory: str, path: str) -> None:
    status, text = asked(laboratory, path)
    assert status in (400, 403, 404)
    assert len(text) < 200  # no listing, and nothing of the machine


def test_a_page_is_read_before_scripts_are_loaded(laboratory: str) -> None:
    status, text = asked(laboratory, "/derivation")
    assert status == 200
    assert "<h1>The discrete adjoint</h1>" in text
    assert text.count("<script defer src=") == text.count(" src=") >= 4


def test_a_port_in_use_is_refused(cli: Callable[..., Ran], laboratory: str) -> None:
    port = laboratory.rpartition(":")[2]
    refused = cli("lab", "--no-browser", "--port", port)
    assert refused.code == 2
    assert refused.err == f"routes: lab: port {port}: Address already in use - name another by --port, or 0\n"


def test_a_port_that_there_is_not_is_refused(cli: Callable[..., Ran]) -> None:
    refused = cli("lab", "--port", "99999")
    assert (refused.code, refused.err) == (2, "routes: --port 99999 - give a whole number from 0 to 65535\n")


@pytest.mark.parametrize("name", ["panel", "bokeh", "latex2mathml"])
def test_without_the_extra_it_says_how_to_get_it(
    cli: Callable[..., Ran], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setitem(sys.modules, name, None)
    refused = cli("lab")
    assert refused.code == 2
    assert refused.err == f"routes: lab: {name} not installed - pip install 'gradient-routes[lab]'\n"


@contextmanager
def served(folder: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A laboratory whose temporary files are in a folder, and whose sessions end soon."""
    folder.mkdir()
    environment = {**os.environ, "TMPDIR": str(folder)}
    with subprocess.Popen(
        [sys.executable, "-c", SHORT], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=environment,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        yield process.stdout.readline().split()[0].rstrip("/"), process
        process.kill()


def ends(process: subprocess.Popen[str], number: signal.Signals, folder: Path) -> None:
    """It ends as it should, and nothing of it is left."""
    started = psutil.Process(process.pid).children(recursive=True)
    process.send_signal(number)
    assert process.wait(PATIENCE) == 130
    assert process.stderr is not None
    assert process.stderr.read() == "routes: interrupted - the laboratory is closed\n"
    assert not psutil.wait_procs(started, timeout=5.0)[1]
    assert not [*folder.iterdir()]


def until(true: Callable[[], bool]) -> None:
    limit = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < limit
        time.sleep(0.05)


def test_it_ends_while_its_processes_start(tmp_path: Path) -> None:
    folder = tmp_path / "t"
    with served(folder) as (_, process):
        ends(process, signal.SIGTERM, folder)


def test_a_page_has_a_folder_of_its_own_and_ends_alone(browser: Browser, tmp_path: Path) -> None:
    folder = tmp_path / "t"
    with served(folder) as (laboratory, process):
        (root,) = folder.iterdir()
        assert root.stat().st_mode & 0o077 == 0
        contexts = [browser.new_context() for _ in range(2)]
        pages = [context.new_page() for context in contexts]
        for page in pages:
            page.add_init_script(KEEP_LINE)
            page.goto(f"{laboratory}/derivation")
            expect(page.locator("td").first).to_have_text("0.125")
        assert len([*root.iterdir()]) == 2
        pages[0].evaluate(f"line.send('x'.repeat({UPLOAD + 1}))")
        pages[0].wait_for_function("line.readyState == 3")
        until(lambda: len([*root.iterdir()]) == 1)
        pages[1].locator(".noUi-handle").nth(1).focus()
        pages[1].keyboard.press("ArrowRight")
        expect(pages[1].locator("code").last).to_contain_text("--at")
        for k in range(20):  # Ctrl-C comes while it computes
            pages[1].keyboard.press("ArrowRight" if k % 2 else "ArrowLeft")
        ends(process, signal.SIGINT, folder)
        for context in contexts:
            context.close()
