"""What a report costs: seconds to build one of 1000 cases, its bytes, seconds until a browser has drawn it.

python -m benchmarks.reporting
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from benchmarks.browser import browser, opened
from benchmarks.invented_store import fill
from gradient_routes.bench.execution.timing import seconds_of
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.units import duration

CASES, STUDIES, REPEATS = 1000, 12, 3
ALLOWED_S, ALLOWED_OPEN_S, ALLOWED_BYTES = 10.0, 2.0, 8e6
CLOCK = """<script>
(async () => {
  await report.draw(report.figures.find((figure) => figure.specs));
  const first = performance.now();
  await report.drawAll();
  document.body.offsetHeight;
  document.documentElement.dataset.opened = `${first} ${performance.now()}`;
})();
</script></body>"""
READ = re.compile(r'data-opened="([\d.]+) ([\d.]+)"')


@dataclass(frozen=True)
class Cost:
    """Of one report. Seconds from the start of navigation, laid out: the first figure, and all; None: no browser."""

    cases: int
    build: float
    bytes: int
    first: float | None
    all: float | None


def cost(cases: int = CASES, studies: int = STUDIES, repeats: int = REPEATS) -> Cost:
    """Medians over repeats, each build in a process of its own, imports included."""
    with tempfile.TemporaryDirectory() as folder:
        store, page = Path(folder) / "routes.sqlite", Path(folder) / "report.html"
        fill(Store(store), cases, studies)
        command = [
            sys.executable,
            "-c",
            "from gradient_routes.bench.cli import main; main()",
            "report",
            "--store",
            str(store),
            "-o",
            str(page),
        ]
        build = median(
            seconds_of(lambda: subprocess.run(command, check=True, capture_output=True))[0] for _ in range(repeats)
        )
        size = page.stat().st_size
        if browser() is None:
            return Cost(cases, build, size, None, None)
        first, every = opening(page, repeats)
    return Cost(cases, build, size, first, every)


def opening(page: Path, repeats: int = REPEATS) -> tuple[float, float]:
    """Seconds until the first figure, and until all, are drawn."""
    timed = page.with_name("timed.html")
    body, _, end = page.read_text("utf-8").rpartition("</body>")
    timed.write_text(f"{body}{CLOCK}{end}", "utf-8")
    found = [READ.search(opened(timed).dom) for _ in range(repeats)]
    times = [(float(m[1]) / 1e3, float(m[2]) / 1e3) for m in found if m is not None]
    return median(t[0] for t in times), median(t[1] for t in times)


def main() -> None:
    out = console()
    found = cost()
    out.print(
        f"a report of {found.cases} cases and {STUDIES} studies of every kind: built in {duration(found.build)}"
        f" (<= {ALLOWED_S:g} s), {found.bytes / 1e6:.2f} MB (< {ALLOWED_BYTES / 1e6:g} MB)"
    )
    if found.first is None or found.all is None:
        out.print("not opened: no Chromium on this machine")
        return
    out.print(
        f"opened in Chromium: first figure after {duration(found.first)} (<= {ALLOWED_OPEN_S:g} s), all, which are"
        f" drawn as they are scrolled to, after {duration(found.all)}"
    )


if __name__ == "__main__":
    main()
