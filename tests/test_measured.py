"""Stories of measured data: files are what their programs make; wrong models are flagged, right ones find the truth."""

from __future__ import annotations

import csv
import re
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import ROOT

MEASURED = ROOT / "examples" / "measured"
RUBBER = f"data={MEASURED}/rubber.csv,noise=5kPa"
GIVEN = "length=400mm,diameter=12mm,conductivity=110,base=85degC,ambient=21.5degC,noise=0.1K"
ROD = f"data={MEASURED}/cooled_rod.csv,{GIVEN}"
WALL = f"data={MEASURED}/heated_wall.csv,n=10,ny=1,size=100mm,exposed=right,density=2300,heat_capacity=880,noise=0.2K"
WALL += ",ambient=20degC,base=60degC,initial=20degC,unknown=diffusivity+film"


def made(name: str) -> dict[str, Any]:
    return runpy.run_path(str(MEASURED / f"make_{name}.py"))


@pytest.mark.parametrize("name", ["rubber", "cooled_rod", "heated_wall"])
def test_files_are_what_their_programs_make(name: str) -> None:
    text = (MEASURED / f"{name}.csv").read_text(encoding="utf-8")
    assert text.splitlines() == made(name)["rows"]()


@pytest.mark.parametrize(
    ("wrong", "right", "truth"),
    [
        (f"coupon[law=neo-hookean,{RUBBER}]", f"coupon[law=yeoh,{RUBBER}]", 1e6 * np.array(made("rubber")["C"])),
        (f"rod[{ROD}]", f"rod[{ROD},parts=2]", np.log(made("cooled_rod")["h"])),
    ],
    ids=["rubber", "rod"],
)
def test_a_wrong_model_is_flagged_and_the_right_one_finds_the_truth(
    wrong: str, right: str, truth: Any, tmp_path: Path, cli
) -> None:
    """Within 3.5 standard deviations: of five constants one is farther off in 400 draws."""
    options = ["--optimizer", "gauss-newton", "--no-plot", "--no-store"]
    flagged = cli("invert", "--problem", wrong, *options)
    assert (flagged.code, "misfit exceeds noise" in flagged.out) == (1, True)
    path = tmp_path / "p.csv"
    ended = cli("invert", "--problem", right, *options, "-o", str(path))
    assert (ended.code, "misfit exceeds noise" in ended.out) == (0, False)
    rows = list(csv.DictReader(path.read_text().splitlines()))
    off = [(float(row["estimate"]) - p) / float(row["sd"]) for row, p in zip(rows, truth, strict=True)]
    assert np.abs(off).max() < 3.5


def test_histories_of_a_wall_find_its_diffusivity_and_film_coefficient(tmp_path: Path, cli) -> None:
    """From a start of steel, which is 36 times off: the data tell a nearer one."""
    path, options = tmp_path / "p.csv", ["--optimizer", "gauss-newton", "--no-plot", "--no-store"]
    wall = f"heat[{WALL},steps=61,dt=5min,scheme=crank-nicolson,conductivity=50]"
    ended = cli("invert", "--problem", wall, *options, "-o", str(path))
    assert (ended.code, "correlated in" in ended.out) == (0, False)
    truth = made("heated_wall")
    for row, value in zip(csv.DictReader(path.read_text().splitlines()), (truth["a"], truth["h"]), strict=True):
        assert abs(float(row["estimate"]) - np.log(value)) < 3.5 * float(row["sd"])


def test_steps_that_are_too_long_are_told_by_where_the_answer_would_go(tmp_path: Path, cli) -> None:
    """By what really changes when they are halved, within the second order of the change; with small residuals."""
    options, found, said = ["--optimizer", "gauss-newton", "--no-plot", "--no-store"], [], []
    for steps in (61, 122):
        path = tmp_path / f"{steps}.csv"
        march = f"steps={steps},dt={305 / steps}min"
        ended = cli("invert", "--problem", f"heat[{WALL},{march}]", *options, "-o", str(path))
        assert (ended.code, "misfit exceeds noise" in ended.out) == (1, False)
        found.append(np.array([float(row["estimate"]) for row in csv.DictReader(path.read_text().splitlines())]))
        said.append(re.search(r"steps in time are too long: half as long, they move (.*) - take more", ended.out))
    moves = dict(re.findall(r"log (\w) by ([-+.\de]+)", said[0][1]))
    told = np.array([float(moves["a"]), float(moves["h"])])
    np.testing.assert_allclose(told, found[1] - found[0], rtol=0.15)
