"""--at FILE: p by the names of parameters, as other commands write it, and what such a file may not be."""

from __future__ import annotations

import csv
from pathlib import Path

import meshio
import numpy as np
import pytest

from gradient_routes.bench.cases.case import point
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.mechanics.materials import LAWS

BLOCK = {"n": 1, "nz": 2, "law": "mooney-rivlin", "derivatives": "hand", "unknown": "constants"}


def test_what_invert_and_run_and_export_write_is_read_again(cli, tmp_path: Path) -> None:
    files = [tmp_path / f"{name}.csv" for name in ("estimates", "exported", "gradient")]
    store = str(tmp_path / "s.sqlite")
    ended = cli(*f"invert --problem bar --optimizer gauss-newton --no-plot --store {store} -o {files[0]}".split())
    assert f"estimates in {files[0]}" in ended.out
    cli(*f"export --table estimates --store {store} -o {files[1]}".split())
    bar = Bar()
    p = point(bar, str(files[0]))
    np.testing.assert_allclose(p[:5], bar.truth()[:5], rtol=1e-9)
    np.testing.assert_array_equal(point(bar, str(files[1])), p)
    run = "run --problem bar --route adjoint --route tangent --no-timing --no-store"
    cli(*f"{run} --at {files[0]} --gradient {files[2]}".split())
    np.testing.assert_array_equal(point(bar, str(files[2])), p)


@pytest.mark.parametrize(
    ("files", "says"),
    [
        ("-o m.npz", "-o m.npz: a map, .npz, is of --linear - "),
        ("-o a.csv -o b.csv", "-o b.csv: a second one - "),
        ("--iterations 1 -o a.vtu", "-o a.vtu: bar has no mesh - take a .csv"),
    ],
)
def test_files_that_cannot_hold_the_answer_are_refused(files: str, says: str, cli) -> None:
    ended = cli(*f"invert --problem bar --no-plot --no-store {files}".split())
    assert (ended.code, says in ended.err) == (2, True)


def test_the_answer_on_the_mesh(cli, tmp_path: Path) -> None:
    """One modulus a layer, as the estimates say."""
    plate = "plate[n=2,derivatives=hand,unknown=layers,layers=2,data=twin]"
    files = [tmp_path / "p.csv", tmp_path / "p.vtu"]
    ended = cli(*f"invert --problem {plate} --no-plot --no-store -o {files[0]} -o {files[1]}".split())
    assert f"estimates in {files[0]}\nfields in {files[1]}" in ended.out
    E = meshio.read(files[1]).cell_data["E"][0]
    estimates = [float(row["estimate"]) for row in csv.DictReader(files[0].read_text().splitlines())]
    np.testing.assert_allclose(sorted({*np.round(np.log(E), 12)}), sorted(estimates), atol=1e-11)  # of the roundings


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_constants_of_constant_volume_are_completed_by_nu(law) -> None:
    q = law.of_modulus(3.0, 0.47)
    assert law.of_volume(q[:-1], 0.47) == pytest.approx(q[-1], rel=1e-12)


def test_constants_of_a_coupon_are_those_of_a_block(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    path.write_text("parameter,unit,estimate\nc2,Pa,2\nc1,Pa,8\n")
    c1, c2, c = point(Block(**BLOCK, nu=0.48), str(path))
    assert (c1, c2, 2.0 * c + 4.0 * c2) == (8.0, 2.0, pytest.approx(20.0 * 2.0 * 0.48 / (1.0 - 2.0 * 0.48)))
    with pytest.raises(InputError, match=r"beside nu=0\.3 - set nu=0\.45 or more, it tells c"):
        point(Block(**BLOCK), str(path))


def test_lame_constants_by_name_are_taken_as_their_logarithms(tmp_path: Path) -> None:
    """As a coupon writes them, compressible or not."""
    path, block = tmp_path / "c.csv", Block(n=1, derivatives="hand", unknown="constants", nu=0.46)
    path.write_text("parameter,unit,estimate\nmu,Pa,2e5\nlam,Pa,-1e5\n")
    assert block.constants.lame(point(block, str(path))) == pytest.approx((2e5, -1e5))
    path.write_text("parameter,unit,estimate\nmu,Pa,2e5\n")
    assert block.stated(point(block, str(path)))["nu"] == pytest.approx(0.46)
    path.write_text("parameter,unit,estimate\nmu,MPa,0.2\n")
    with pytest.raises(InputError, match=r"mu is in MPa, not in Pa - convert it"):
        point(block, str(path))
    path.write_text("parameter,unit,estimate\nmu,Pa,3\nlam,Pa,-4\n")
    with pytest.raises(InputError, match=r"mu=3, lam=-4: K = -2 Pa"):
        point(block, str(path))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a,b\n1,2\n", "has 2 columns - --at reads one, with a header line, or columns parameter and estimate or p"),
        ("parameter,p\nc1,1\nc1,2\n", "c1 is 1 and 2, of several runs - keep the rows of one"),
        ("parameter,p\nmu,1\n", "mu is no parameter of block: c1, c2, c - choose its law"),
        ("parameter,p\nc1,1\n", "has no c2, c of block - give all parameters"),
        ("parameter,unit,p\nc1,MPa,1\n", "c1 is in MPa, of block in Pa - convert it"),
        ("parameter,p\nc1,nan\n", "nan is not finite"),
    ],
)
def test_files_that_are_no_point_are_one_line(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "p.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        point(Block(**BLOCK), str(path))
    assert says in str(caught.value)
