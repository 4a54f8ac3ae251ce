"""A Chromium without a window: what it makes of a page, and what it complains of."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
COMPLAINT = re.compile(r"CONSOLE.*")
DARK = "--blink-settings=preferredColorScheme=0"


@dataclass(frozen=True)
class Opened:
    """The document after its scripts ran, and its console's lines."""

    dom: str
    console: list[str]


def browser() -> str | None:
    """The path of one, if this machine has any."""
    return next((path for name in NAMES if (path := shutil.which(name)) is not None), None)


def opened(page: Path, *options: str, width: int = 1280, height: int = 800, timeout: float = 120.0) -> Opened:
    """Open a file. Raises FileNotFoundError where there is no browser, CalledProcessError where it fails."""
    path = browser()
    if path is None:
        raise FileNotFoundError(f"none of {', '.join(NAMES)}")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        done = subprocess.run(
            [
                path,
                "--headless",
                "--disable-gpu",
                "--hide-scrollbars",
                "--enable-logging=stderr",
                "--v=0",
                *(["--no-sandbox"] if os.name == "posix" and os.geteuid() == 0 else []),
                f"--user-data-dir={profile}",
                f"--window-size={width},{height}",
                *options,
                "--dump-dom",
                page.absolute().as_uri(),
            ],
            capture_output=True,
            text=True,
            encoding="utf-8",
            timeout=timeout,
            check=True,
        )
    return Opened(done.stdout, COMPLAINT.findall(done.stderr))
