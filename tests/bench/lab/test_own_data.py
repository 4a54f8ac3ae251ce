"""Own data: a file is dropped, estimates and what they rest on are those of the command; bad files are one line."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import pytest
from commands import Ran
from playwright.sync_api import FilePayload, Page, expect

from gradient_routes.bench.lab import upload
from gradient_routes.bench.lab.numbers import number
from gradient_routes.bench.lab.parts.own_data import ESTIMATES, EXAMPLE, READINGS, OwnData
from gradient_routes.bench.lab.place import Place
from gradient_routes.bench.lab.pool import Pool
from gradient_routes.bench.lab.results.estimates import estimates, said
from gradient_routes.problems.errors import InputError


def of(**query: str) -> OwnData:
    nowhere = cast(Pool, None)
    return OwnData(Place(nowhere, nowhere, Path("/")), query)


@pytest.mark.parametrize(
    ("state", "command"),
    [
        (
            {"data": "a.csv", "noise": "0.4um", "units": "mm", "options": "n=4,length=250mm"},
            "invert --problem 'bar[n=4,length=250mm,data=a.csv,noise=0.4um]' --units mm -o estimates.csv",
        ),
        (
            {"problem": "plate", "data": "a.csv", "columns": "x=X,ux=U", "optimizer": "gauss-newton"},
            "invert --problem 'plate[data=a.csv]' --columns x=X,ux=U --optimizer gauss-newton -o estimates.csv",
        ),
        ({"mode": "identify", "data": "a.csv"}, "identify --problem 'bar[data=a.csv]'"),
    ],
)
def test_a_state_is_a_command(state: dict[str, str], command: str) -> None:
    assert shlex.join(of(**state).command()) == command


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ({}, "no data yet"),
        ({"data": "../secret.csv"}, "is no plain name"),
        ({"data": "/etc/passwd"}, "is no plain name"),
        ({"data": "twin"}, "is no plain name"),
        ({"data": "a.csv", "options": "data=b.csv"}, "data= names a file"),
        ({"data": "a.csv", "options": "noise=1", "noise": "2"}, "has a field of its own"),
        ({"data": "a.csv", "options": "m=1"}, "no option 'm'"),
        ({"data": "a.csv", "noise": "1,data=b.csv"}, "is no number with a unit"),
    ],
)
def test_what_is_no_file_that_was_dropped_is_refused_in_one_line(state: dict[str, str], words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)) as refused:
        of(**state).command()
    assert "\n" not in str(refused.value)


def test_files_lie_in_their_folder_under_plain_names(tmp_path: Path) -> None:
    (folder := tmp_path / "page").mkdir()
    for name in ("../../up.csv", "..\\up.csv", "C:\\up.csv", ".up.csv"):
        assert upload.keep(folder, name, b"1\n") == "up.csv"
    assert upload.keep(folder, "a b;c|d,e].csv", "1\n") == "a_b_c_d_e_.csv"
    assert len(upload.plain("x" * 500)) <= upload.LONGEST + 4
    assert {path.name for path in tmp_path.iterdir()} == {"page"}
    with pytest.raises(InputError, match="> 5 MiB - drop a smaller file"):
        upload.keep(folder, "big.csv", bytes(upload.MOST + 1))
    assert not (folder / "big.csv").exists()


def test_error_bars_are_drawn_where_there_are_some() -> None:
    row = {"parameter": "log E_1", "start": 0.0, "estimate": 1.0, "sd": 0.25}
    drawn = estimates([row, row | {"sd": None}])
    assert (drawn["low"], drawn["high"]) == ([0.75, 1.0], [1.25, 1.0])


def test_a_model_that_does_not_explain_the_data_is_told() -> None:
    step = {"says": "converged: <so>", "iteration": 1}
    fit: dict[str, Any] = {"verdict": "the model does not explain the data", "data": 3, "rms": 0.1}
    text = said([step], [fit | {"noise": None, "noise_source": None, "chi2": None}])
    assert 'class="verdict bad">the model does not explain the data<' in text
    assert "converged: &lt;so&gt;" in text


def drop(page: Page, name: str, content: bytes) -> None:
    page.locator("input[type=file]").set_input_files(FilePayload(name=name, mimeType="text/csv", buffer=content))


def shown(page: Page) -> list[str]:
    return shlex.split(page.locator("code").last.text_content() or "")


def test_the_example_is_estimated_and_taken_along(
    page: Page, laboratory: str, cli: Callable[..., Ran], tmp_path: Path
) -> None:
    page.goto(f"{laboratory}/own-data?noise=1e-3")
    with page.expect_download() as taken:
        page.get_by_role("button", name="An example to drop").click()
    assert Path(taken.value.path()).read_text() == READINGS
    drop(page, EXAMPLE, READINGS.encode())
    expect(page.locator("#fit")).to_contain_text("explained")
    (tmp_path / EXAMPLE).write_text(READINGS)
    rows = cli(*shown(page)[1:], "--json", "--no-store").rows
    found = [row for row in rows if row["table"] == "estimates"]
    table = page.get_by_role("table").first.locator("tbody tr")
    expect(table.locator(":nth-child(3)")).to_have_text([number(row["estimate"], 6) for row in found])
    expect(table.locator(":nth-child(4)")).to_have_text(["" if r["sd"] is None else number(r["sd"], 3) for r in found])
    expect(table.locator(":nth-child(5)")).to_have_text(["blind" if row["blind"] else "" for row in found])
    expect(page.locator("#ended")).to_have_text([row for row in rows if row["table"] == "inversion"][-1]["says"])
    with page.expect_download() as taken:
        page.get_by_role("button", name="Estimates as CSV").click()
    assert Path(taken.value.path()).read_text() == (tmp_path / ESTIMATES).read_text()
    page.get_by_label("What").select_option("what the data determine")
    expect(page.locator("#rank")).to_contain_text("5 of 8 directions identifiable from 5 data")
    (whole,) = [r for r in cli(*shown(page)[1:], "--json", "--no-store").rows if r["table"] == "experiments"]
    assert (whole["rank"], whole["data"], whole["blind"]) == (5, 5, 3)


def test_a_figure_is_taken_along_as_png(page: Page, laboratory: str) -> None:
    page.goto(f"{laboratory}/own-data?noise=1e-3&options=n=2")
    drop(page, EXAMPLE, b"node,displacement\n1,0.1\n2,0.2\n")
    expect(page.locator("#fit")).to_contain_text("explained")
    with page.expect_download() as taken:
        page.get_by_title("Save").first.click()
    assert taken.value.suggested_filename == "estimates.png"
    assert Path(taken.value.path()).read_bytes().startswith(b"\x89PNG")


BAD = {
    "empty.csv": (b"", "the file is empty"),
    "words.csv": (b"node,displacement\na,b\n", "line 2, column node: 'a' is not a number"),
    "columns.csv": (b"foo,bar\n1,2\n", "no column node; it has foo, bar"),
    "binary.csv": (bytes(range(256)), "is not text in UTF-8"),
    "../../up.csv": (b"node,displacement\n9,1\n", "up.csv: "),
}


def test_a_bad_file_is_one_line(page: Page, laboratory: str) -> None:
    page.goto(f"{laboratory}/own-data")
    said = page.locator("p[role=status]").first
    expect(said).to_contain_text("no data yet")
    for name, (content, words) in BAD.items():
        drop(page, name, content)
        expect(said).to_contain_text(words)
        expect(said.locator("br")).to_have_count(0)
    drop(page, "big.csv", bytes(6 * 2**20))
    expect(page.get_by_role("alert")).to_contain_text("Maximum file size is 5 MB")
    assert "big.csv" not in (page.locator("code").last.text_content() or "")


def test_a_file_for_a_larger_problem_is_run_when_it_is_dropped(page: Page, laboratory: str) -> None:
    rod = "n=4,length=300mm,diameter=10mm,conductivity=50,base=100degC,ambient=20degC"
    page.goto(f"{laboratory}/own-data?problem=rod&noise=0.1K&options={rod}")
    drop(page, "rod.csv", b"x [mm];T [degC]\n50;80\n150;60\n250;50\n")
    expect(page.locator("#ended")).to_be_visible()
    expect(page.get_by_role("button", name="Run")).to_be_visible()
