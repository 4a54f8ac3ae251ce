"""Measured files: headers, units, separators, marks of missing values, repeated points, points outside, noise."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
import pytest
from commands import Ran

from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.data import csv
from gradient_routes.problems.data.csv import read_columns
from gradient_routes.problems.data.probes import Measured, groups, read_probes
from gradient_routes.problems.data.table import Group, Table, read_table
from gradient_routes.problems.data.units import UNITS, factor, quantity, zero
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.elements import Geometry
from gradient_routes.problems.fem.locating import locate
from gradient_routes.problems.fem.mesh import Mesh, box_mesh
from gradient_routes.routes.model import Model
from gradient_routes.routes.sensitivity import sensitivities

File = Callable[[str | bytes], str]
SI = "x,y,z,ux,uy,uz\n0.5,0.25,0.75,1e-6,,-2e-6\n1,0,1,3e-6,4e-6,5e-6\n"


@pytest.fixture
def file(tmp_path: Path) -> File:
    def written(text: str | bytes) -> str:
        path = tmp_path / "d.csv"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return str(path)

    return written


@pytest.fixture(scope="module")
def box() -> Mesh:
    return box_mesh("block", "hex8", (2, 3, 4), (1.0, 1.0, 1.0))


def read(path: str, columns: str | None = None, units: str | None = None) -> Table:
    return read_table(path, groups("xyz"), columns, units)


def values(table: Table) -> np.ndarray:
    return table.stack(("x", "y", "z", "ux", "uy", "uz"))


FORMS: dict[str, tuple[str | bytes, str | None, str | None, str]] = {
    "as it is": (SI, None, None, ""),
    "units in brackets": (
        "x-coordinate [mm],Y [mm],z_coordinate [mm],ux (um),x y,u_y (um),z-displacement (um)\n"
        "500,250,750,1,7,,-2\n1000,0,1000,3,7,4,5\n",
        None,
        None,
        "read x = x-coordinate, y = Y, z = z_coordinate in mm, factor 0.001 / ux, uy = u_y, uz = z-displacement in um,"
        " factor 1e-06 / not read: x y",
    ),
    "decimal commas": (
        "x;y;z;ux (um);uy (um);uz (um)\n0,5;0,25;0,75;1;;-2\n1;0;1;3;4;5\n",
        None,
        "x:m,y:m,z:m",
        "read x, y, z in m, factor 1 / ux, uy, uz in um, factor 1e-06",
    ),
    "tabs, blank lines, heads": (
        "# DIC\n\n% Ann\nx\ty\tz\tux\tuy\tuz\n\n0.5\t0.25\t0.75\t1e-6\t\t-2e-6\n# end\n1\t0\t1\t3e-6\t4e-6\t5e-6",
        None,
        None,
        "",
    ),
    "NumPy's header": ("# x,y,z,ux,uy,uz\n" + SI.partition("\n")[2], None, None, ""),
    "quotes": (
        '"x","y","z","ux","uy","uz"\n"0.5","0.25","0.75","1e-6","","-2e-6"\n1,0,1,3e-6,4e-6,5e-6\n',
        None,
        None,
        "",
    ),
    "Windows' micro sign": (
        "x [mm]\ty [mm]\tz [mm]\tux [µm]\tuy [µm]\tuz [µm]\r\n"
        "500\t250\t750\t1\t\t-2\r\n1000\t0\t1000\t3\t4\t5\r\n".encode("cp1252"),
        None,
        None,
        "read x, y, z in mm, factor 0.001 / ux, uy, uz in µm, factor 1e-06",
    ),
    "named columns": (
        "a,b [mm],q, c,d\n500,1e-3,750,0,-2e-3\n1000,3e-3,1000,4,5e-3\n",
        "x=a,y=250mm,z=q,uz=d,ux=b [mm]",
        "x=mm,z=mm,uz=mm",
        "read x = a, z = q, ux = b, uz = d in mm, factor 0.001 / y = 0.25 in every row / not read: c",
    ),
    "shifted": (
        "x [mm],y,z,ux,uy,uz\n510,0.25,0.75,1e-6,,-2e-6\n1010,0,1,3e-6,4e-6,5e-6\n",
        "x:x - 10mm",
        "x:mm,y:m,z:m,ux:m,uy:m,uz:m",
        "read x in mm, factor 0.001 / y, z, ux, uy, uz in m, factor 1 / x shifted by -0.01",
    ),
    "pixels": (
        "x,y,z,ux,uy,uz\n500,250,750,1e-3,,-2e-3\n1000,0,1000,3e-3,4e-3,5e-3\n",
        None,
        "px,px=1mm",
        "read x, y, z, ux, uy, uz in px, factor 0.001",
    ),
}


@pytest.mark.parametrize("form", FORMS)
def test_one_table_reads_the_same_in_every_form(form: str, file: File) -> None:
    text, columns, units, said = FORMS[form]
    wanted = values(read(file(SI)))
    if form == "named columns":
        wanted[:, 1], wanted[:, 4] = 0.25, np.nan  # y is given for every row, uy is not measured
    table = read(file(text), columns, units)
    np.testing.assert_allclose(values(table), wanted, rtol=1e-14)  # of a factor and a shift, each rounded
    assert table.said == said


def test_blocks_of_lines_are_read_as_one(file: File, monkeypatch: pytest.MonkeyPatch) -> None:
    """Across the borders of blocks, with empty cells and a blank line: each number in its place, each row its line."""
    monkeypatch.setattr(csv, "BLOCK", 4)
    n = 19
    rows = [f"{i},0.5,0.25,{i}e-9" for i in range(n)]
    rows[7], rows[12] = "7,0.5,0.25,", "12,0.5,0.25,"
    table = read(file("\n".join(["x,y,z,ux", *rows[:5], "", *rows[5:]])))
    np.testing.assert_array_equal(table.columns["x"], np.arange(n))
    assert np.flatnonzero(np.isnan(table.columns["ux"])).tolist() == [7, 12]
    assert table.lines[[0, 4, 5, n - 1]].tolist() == [2, 6, 8, n + 2]


HEAD = "x,y,z,ux\n"
UNREADABLE: dict[str, tuple[str | bytes, str, dict[str, str]]] = {
    "empty": ("", "the file is empty", {}),
    "heads alone": ("# a\n\n", "the file is empty", {}),
    "no rows": (HEAD, "no rows - add one row", {}),
    "no header": ("1,2,3,4\n", "line 1 holds numbers - ", {}),
    "binary": (b"\x89PNG\xff\x00\n", "not text in UTF-8", {}),
    "no coordinates": ("ux,uy\n1,2\n", "no column x, y, z; it has ux, uy - rename or add it, or name it: columns=", {}),
    "spaces": ("x y z ux\n1 2 3 4\n", "no column x, y, z; it has x y z ux", {}),
    "twice": ("x,y,z,ux,X\n1,2,3,4,5\n", "column x is given 2 times (column 1 is x, column 5 is X) - keep one", {}),
    "a decimal comma": (HEAD + "0,5,1,2,3\n", "line 2 has 5 cells, the header 4 - if ',' is the decimal comma", {}),
    "a cell too few": (HEAD + "1,2,3,4\n\n1,2,3\n", "line 4 has 3 cells, the header 4 - correct the line", {}),
    "two marks": ("x;y;z;ux\n1;2;3;4,5\n1;2;3;4.5\n", "4,5 in line 2 has a comma, 4.5 in line 3 a point - ", {}),
    "thousands": ("x;y;z;ux\n1;2;3;1.234,5\n", "1.234,5 in line 2 has a comma, 1.234,5 in line 2 a point", {}),
    "text": (HEAD + "1,2,3,four\n", "line 2, column ux: 'four' is not a number", {}),
    "underscores": (HEAD + "1_0,2,3,4\n", "line 2, column x: '1_0' is not a number", {}),
    "nan": (HEAD + "1,2,3,4\n1,2,3,nan\n", "line 3, column ux: nan is not finite", {}),
    "too large": (HEAD + "1,2,3,1e999\n", "line 2, column ux: 1e999 is not finite", {}),
    "a coordinate missing": (HEAD + "1,,3,4\n", "line 2, column y: '' is not a number", {}),
    "-999": (HEAD + "1,2,3,0.5\n1,2,4,-999\n1,2,5,-999\n", "column ux holds -999 in 2 of 3 rows, first in line 3", {}),
    "one -9999": (HEAD + "1,2,3,0.5\n1,2,4,-9999\n", "column ux holds -9999 in 1 of 2 rows", {}),
    "-999 among numbers as large": (HEAD + "1,2,3,800.5\n1,2,4,-999\n1,2,5,1200.5\n1,2,6,-999\n", "-999 in 2 of 4", {}),
    "a sentinel of no name": (HEAD + "1,2,3,2\n1,2,4,-32768\n1,2,5,-32768\n", "a mark of missing values? - ", {}),
    "frames": ("x,y,z,ux,Frame\n1,2,3,4,5\n", "column Frame tells cases apart, and as one their rows would be", {}),
    "no such unit": (
        "x [cm],y [cm],z [cm],ux [cm]\n1,2,3,4\n",
        "column x: unit 'cm' is not known - the units are m, mm, um; Pa, kPa, MPa, GPa, N/mm2; N,",
        {},
    ),
    "no such unit beside one": (
        "x [mm],y [mm],z [mm],ux [furlong]\n1,2,3,4\n",
        "ux: unit 'furlong' is not known - the units are m, mm, um;",
        {},
    ),
    "a unit of stress": (
        "x [MPa],y [MPa],z [MPa],ux\n1,2,3,4\n",
        "'MPa' is a unit of stress, not of length",
        {"units": "ux:mm"},
    ),
    "pixels": ("x [px],y [px],z [px],ux [px]\n1,2,3,4\n", "give its scale, as in units=px:0.02mm", {}),
    "mm beside m": (
        "x [mm],y [m],z [mm],ux [mm]\n1,2,3,4\n",
        "mixed units, x:mm, y:m, z:mm - if that is right say so:",
        {},
    ),
    "mm beside nothing": ("x [mm],y [mm],z [mm],ux\n1,2,3,4\n", "ux (ux) states no unit - state it: units=ux:mm", {}),
    "units=inch": (HEAD + "1,2,3,4\n", "units=inch: unit 'inch' is not known - the units are m,", {"units": "inch"}),
    "units of nothing": (HEAD + "1,2,3,4\n", "nothing is called u - the names are x, y, z, ux", {"units": "u:mm"}),
    "two units": (HEAD + "1,2,3,4\n", "mm and um for every length - name columns", {"units": "mm,um"}),
    "a unit too much": ("x [m],y [m],z [m],ux [m]\n1,2,3,4\n", "no column without a unit is a length", {"units": "mm"}),
    "no such column": (
        HEAD + "1,2,3,4\n",
        "no column dy; it has x, y, z, ux - correct columns=uy:",
        {"columns": "uy=dy"},
    ),
    "no such name": (HEAD + "1,2,3,4\n", "nothing is called v - the names are x, y, z, ux", {"columns": "v=ux"}),
    "no pair": (HEAD + "1,2,3,4\n", "'ux' is no pair - write columns=x:NAME,ux:NAME", {"columns": "ux"}),
    "a name twice": (HEAD + "1,2,3,4\n", "ux is given twice - keep one", {"columns": "ux=x,ux=y"}),
}


@pytest.mark.parametrize("case", UNREADABLE)
def test_what_cannot_be_understood_is_refused_in_one_line(case: str, file: File) -> None:
    text, says, options = UNREADABLE[case]
    with pytest.raises(InputError, match=re.escape(says)) as caught:
        read(file(text), **options)
    assert "\n" not in str(caught.value)
    assert " - " in str(caught.value), "an error says what to do"


def test_numbers_that_look_like_marks_but_are_measured_are_read(file: File) -> None:
    """A box of 100 mm has its ends at 0 and 100, and 999 among hundreds is a number."""
    table = read(file(HEAD + "0,0,0,500\n100,0,0,999\n100,100,99,400\n"))
    assert table.columns["x"].tolist() == [0.0, 100.0, 100.0]
    assert table.columns["ux"].tolist() == [500.0, 999.0, 400.0]


def test_units_are_a_closed_list() -> None:
    for kind, factors in UNITS.items():
        for unit, wanted in factors.items():
            assert factor(unit, kind, "test") == wanted
            assert quantity(f"2.5e1 {unit}", kind, "test") == 25.0 * wanted + zero(unit, kind)
    assert quantity(0.5, "length", "test") == quantity("0.5", "length", "test") == 0.5
    for text in ("nan", "inf", "x", "", "um", "0,4um", "1e999um", "0.4 parsec"):
        with pytest.raises(InputError, match="test: "):
            quantity(text, "length", "test")


@pytest.mark.parametrize("header", ["t [min],T [degC]", "T [degC],t [min]", "Time [min],Temperature [degC]"])
def test_a_time_and_a_temperature_are_told_apart(header: str, file: File) -> None:
    """Their names differ by case alone, which does not matter elsewhere."""
    groups = (Group(("t",), "time"), Group(("T",), "temperature"))
    rows = "20,1.5\n" if header.startswith("T [") else "1.5,20\n"
    table = read_table(file(f"{header}\n{rows}"), groups)
    assert (table.columns["t"].tolist(), table.columns["T"].tolist()) == ([90.0], [293.15])
    with pytest.raises(InputError, match=re.escape("no column t; it has T [degC]")):
        read_table(file("T [degC]\n20\n"), groups)


# --- points


def probes(box: Mesh, path: str, outside: str = "refuse", noise: float = 0.0) -> Measured:
    return read_probes(box, path, outside=outside, noise=noise)  # type: ignore[arg-type]


OUTSIDE = HEAD + "0.5,0.5,0.5,1\n0.5,0.5,1.5,2\n1.0005,0,0,3\n-0.25,0.5,0.5,4\n"


def test_points_outside_are_counted_and_refused_dropped_or_moved(box: Mesh, file: File) -> None:
    """0.5 above and 0.25 beside a unit cube; 0.0005 is rounding of coordinates."""
    path = file(OUTSIDE)
    says = (
        "data row 2 at (0.5, 0.5, 1.5) lies outside block, whose box of 1, 1, 1 m begins at (0, 0, 0) (2 of 4 rows do,"
    )
    with pytest.raises(InputError, match=re.escape(f"{says} by up to 0.5 m) - check coordinates and units")):
        probes(box, path)
    dropped, snapped = probes(box, path, "drop"), probes(box, path, "snap")
    said = "2 of 4 points lie outside block, by up to 0.5 m, and are"
    assert dropped.notes == (f"{said} left out",)
    assert snapped.notes == (f"{said} moved to the nearest one inside",)
    assert dropped.d[0][:, 0].tolist() == [1.0, 3.0]
    assert snapped.d[0][:, 0].tolist() == [1.0, 2.0, 3.0, 4.0]
    np.testing.assert_allclose(
        snapped.probes[0].x, [[0.5, 0.5, 0.5], [0.5, 0.5, 1], [1.0005, 0, 0], [0, 0.5, 0.5]], atol=1e-12
    )
    for found in (dropped.probes[0], snapped.probes[0]):
        np.testing.assert_allclose(found.read(box.geometry.X[found.nodes]), found.x, atol=1e-12)


def test_what_is_left_inside_has_to_measure_something(box: Mesh, file: File) -> None:
    with pytest.raises(InputError, match="measures nothing"):
        probes(box, file(HEAD + "0.5,0.5,0.5,\n0.5,0.5,1.5,2\n"), "drop")


def test_points_in_a_hole_are_outside(file: File) -> None:
    """Of 5 x 5 columns of cells the middle one is missing: its middle is 0.1 from the body."""
    full = box_mesh("block", "hex8", (5, 5, 1), (1.0, 1.0, 1.0))
    left = np.abs(full.geometry.centres[:, :2] - 0.5).max(axis=1) > 0.1
    holed = Mesh("plate", full.skfem_mesh, Geometry(full.geometry.element, full.geometry.nodes[left], full.geometry.X))
    path = file(HEAD + "0.5,0.5,0.5,1\n0.3,0.5,0.5,1\n")
    with pytest.raises(InputError, match=re.escape("(1 of 2 rows do, by up to 0.1 m)")):
        probes(holed, path)
    snapped = probes(holed, path, "snap").probes[0].x[0] - 0.5
    assert np.abs(snapped).max() == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("unit", "says"), [(1e3, "in mm beside a mesh in m?"), (1e-3, "in m beside a mesh in mm (mesh_unit=mm)?")]
)
def test_another_unit_than_the_mesh_is_named(unit: float, says: str, file: File) -> None:
    """Points all over a cube of 2 m, and one outside."""
    body = box_mesh("block", "hex8", (1, 1, 1), (2.0, 2.0, 2.0))
    rows = [f"{x * unit},{y * unit},{z * unit},0\n" for x in (0.1, 1.9) for y in (0.1, 1.9) for z in (0.1, 1.9)]
    with pytest.raises(InputError, match=re.escape(says)):
        probes(body, file("".join([HEAD, *rows, "-0.004,0,0,0\n"])))


@pytest.mark.parametrize("element", ["hex8", "tet4", "tet10"])
def test_points_are_located_as_a_search_of_all_cells_does(element: str) -> None:
    """Distances of 200 points in and about a body of uneven, flat cells; by brute force over all cells."""
    body = box_mesh("block", element, (2, 1, 2), (3.0, 1.0, 0.2))  # type: ignore[arg-type]
    X = body.geometry.X + 0.3 * body.geometry.X[:, [1, 2, 0]] ** 2 * [1.0, 0.0, 0.0]
    geometry = Geometry(body.geometry.element, body.geometry.nodes, X)
    rng = np.random.default_rng(1)
    x = rng.uniform(X.min(axis=0) - 0.05, X.max(axis=0) + 0.05, (200, 3))
    found = locate(geometry, x)
    N, _ = geometry.element.shape_functions(found.xi.T)
    inside = found.distance == 0.0
    assert 50 < inside.sum() < 200
    at = np.einsum("ka,kai->ki", N, X[geometry.nodes[found.cells]])
    np.testing.assert_allclose(at[inside], x[inside], atol=1e-8)
    cells = range(len(geometry.nodes))
    each = [locate(Geometry(geometry.element, geometry.nodes[[cell]], X), x).distance for cell in cells]
    np.testing.assert_allclose(found.distance, np.min(each, axis=0), atol=0.02)
    assert (inside == (np.min(each, axis=0) == 0.0)).all()


# --- one point measured twice, noise


REPEATED = HEAD + "0.5,0.5,0.5,1e-3\n0.5,0.5,1,2e-3\n0.5,0.5,0.5,{}\n"


def test_rows_that_repeat_others_count_once_and_other_values_are_refused(box: Mesh, file: File) -> None:
    found = probes(box, file(REPEATED.format("1e-3")))
    assert found.notes == ("rows that repeat others are left out: 1",)
    assert found.d[0][:, 0].tolist() == [1e-3, 2e-3]
    says = (
        "lines 2 and 4: point 0.5, 0.5, 0.5 is given twice, with values that differ by 0.0004; 1 such pairs in all - "
    )
    with pytest.raises(InputError, match=re.escape(says)):
        probes(box, file(REPEATED.format("1.4e-3")))
    with pytest.raises(InputError, match="is given twice"):  # 6 standard deviations of the difference are 3.4e-4
        probes(box, file(REPEATED.format("1.4e-3")), noise=4e-5)
    found = probes(box, file(REPEATED.format("1.4e-3")), noise=5e-5)  # 4.2e-4
    assert found.notes == ("pairs of rows that measure one point, within their noise: 1",)
    assert len(found.d[0]) == 3


def test_pairs_tell_the_noise_that_is_not_stated_unless_they_are_of_two_loads(box: Mesh, file: File) -> None:
    g, z = np.random.default_rng(0), np.linspace(0.1, 0.9, 9)
    for second, says in ((1.0, "within a noise of "), (1.5, None)):
        rows = [(z_i, load * 1e-3 * z_i + 1e-5 * g.standard_normal()) for z_i in z for load in (1.0, second)]
        path = file(HEAD + "".join(f"0.5,0.5,{z_i:g},{u:.9g}\n" for z_i, u in rows))
        if says:
            (note,) = probes(box, path).notes
            assert says in note
            assert note.endswith("that they tell: 9")
        else:
            with pytest.raises(InputError, match="is given twice"):
                probes(box, path)


def test_two_rows_may_measure_two_components_of_one_point(box: Mesh, file: File) -> None:
    found = probes(box, file("x,y,z,ux,uz\n0.5,0.5,1,1e-3,\n0.5,0.5,1,,2e-3\n"))
    assert found.probes[0].measured.sum() == 2
    assert found.notes == ()


def test_the_bar_reads_its_file_alike(file: File) -> None:
    text = "node;displacement [mm];by\n3;300,5;Ann\n1;100;Bob\n3;300,5;Ann\n"
    bar = Bar(data=file(text), noise="0.4mm")
    assert (bar.sensors.nodes.tolist(), bar.noise) == ([3, 1], 4e-4)
    np.testing.assert_allclose(bar.sensors.d, [0.3005, 0.1], rtol=1e-15)
    assert bar.read_as[0] == "read node as given / displacement in mm, factor 0.001 / not read: by"
    assert bar.notes[-2:] == bar.read_as
    seen = bar.observation(np.zeros(8), bar.parameters.start)
    assert seen.sigma == 4e-4
    assert Bar(data=file("node,displacement,sigma\n1,0.1,1e-3\n2,0.2,1e-3\n")).noise == 1e-3
    doubtful = Bar(data=file("node,displacement\n1,0.1\n"), noise=0.4).read_as
    assert doubtful == ("noise of 0.4 m beside data up to 0.1 m: are the units right?",)


@pytest.mark.parametrize(
    ("text", "options", "says"),
    [
        ("node,displacement\n1,0.1\n1,0.2\n", {}, "node 1 is given twice"),
        ("node,displacement\n1,0.1\n2,-999\n", {}, "column displacement holds -999 in 1 of 2 rows"),
        ("node,displacement [mm],load\n1,0.1,1\n", {}, "column load tells cases apart"),
        ("node [mm],displacement [mm]\n1,0.1\n", {}, "'mm' is a unit of length, not of number - leave the unit out"),
        ("node,displacement\n1,0.1\n", {"noise": "0um"}, "noise=0um - give a standard deviation > 0, or leave it out"),
        ("node,displacement\n1,0.1\n", {"noise": -1e-3}, "noise=-0.001 - give a standard deviation > 0"),
        ("node,displacement\n1,0.1\n", {"noise": "1 kPa"}, "'kPa' is a unit of stress"),
        ("node,displacement,sigma\n1,0.1,0\n", {}, "line 2: sigma is 0 m - give a standard deviation > 0"),
        ("node,displacement,sigma\n1,0.1,1e-3\n2,0.1,2e-3\n", {}, "0.001 to 0.002 m - bar weighs all data alike"),
        ("node,displacement,sigma\n1,0.1,1e-3\n", {"noise": 1e-3}, "both state the noise - keep one"),
    ],
)
def test_bad_files_of_the_bar(text: str, options: dict[str, str], says: str, file: File) -> None:
    with pytest.raises(InputError, match=re.escape(says)):
        Bar(data=file(text), **options)  # type: ignore[arg-type]


SMALL = {"n": 1, "law": "linear", "derivatives": "ad", "unknown": "constants"}
NOISY = "x [mm],y [mm],z [mm],ux (um),uz (um),sigma_x (um),sigma_z (um)\n500,500,1000,10,,1,\n1000,0,1000,,20,,4\n"


def test_data_are_weighted_by_their_noise(file: File) -> None:
    """J = sigma^2 / 2 sum of (r_i / sigma_i)^2 with 1 / sigma^2 the mean of 1 / sigma_i^2; so is the observation."""
    block = Block(**SMALL, data=file(NOISY))
    p, u = block.parameters.start, np.linspace(0.1, 0.2, block.n_state)
    read = block.data.probes[0].read(block.solid.displacements(u, block.solid.setup(p), 0, block.data.probes[0].nodes))
    r, sigma_i = np.array([read[0, 0] - 1e-5, read[1, 2] - 2e-5]), np.array([1e-6, 4e-6])
    sigma = np.mean(sigma_i**-2.0) ** -0.5
    seen = block.observation(u, p)
    assert seen.sigma == pytest.approx(sigma, rel=1e-14)
    assert block.objective(u, p) == pytest.approx(0.5 * sigma**2 * ((r / sigma_i) ** 2).sum(), rel=1e-13)
    np.testing.assert_allclose(seen.predicted - seen.data, sigma / sigma_i * r, rtol=1e-13)
    lin = block.linearize(u, p)
    np.testing.assert_allclose(seen.S_u.T @ (seen.predicted - seen.data), lin.J_u, rtol=1e-12, atol=1e-18)
    v = np.linspace(-1.0, 1.0, len(u))
    step = 1e-30j  # complex step: no cancellation
    assert (block.objective(u + step * v, p)).imag / 1e-30 == pytest.approx(lin.J_u @ v, rel=1e-12)
    assert seen.relative == pytest.approx(sigma / sigma_i)
    plain = Block(**SMALL, data=file(NOISY.replace("sigma", "about")))
    by_p = [sensitivities(model, model.solve(p)).dSu_dp for model in map(Model, (block, plain))]
    np.testing.assert_allclose(*by_p, rtol=1e-12, atol=1e-15)  # of readings, whatever their weights


@pytest.mark.parametrize(
    ("text", "options", "says"),
    [
        (NOISY.replace(",4\n", ",0\n"), {}, "line 3: the noise of uz is 0 m, in 1 rows in all it is not above 0"),
        (NOISY.replace(",4\n", ",\n"), {}, "line 3: the noise of uz is none"),
        (NOISY, {"noise": "1um"}, "noise=1e-06 and column sigma_x both state the noise - keep one"),
        (NOISY.replace("sigma_x", "sigma"), {}, "columns sigma, sigma_z state the noise twice - keep one"),
        (SI, {"noise": "-1um"}, "noise=-1um - give a standard deviation > 0"),
    ],
)
def test_bad_noise_of_the_block(text: str, options: dict[str, str], says: str, file: File) -> None:
    with pytest.raises(InputError, match=re.escape(says)):
        Block(**SMALL, data=file(text), **options)


def test_noise_of_a_file_is_known_to_the_observation(file: File) -> None:
    block = Block(**SMALL, data=file(SI), noise="0.4um")
    u = np.zeros(block.n_state)
    assert block.observation(u, block.parameters.start).sigma == pytest.approx(4e-7)
    with pytest.raises(InputError, match="outside needs data=FILE"):
        Block(**SMALL, outside="drop")


# --- the command line


def test_columns_and_units_are_options_of_commands(cli: Callable[..., Ran]) -> None:
    """--columns, --units and the selector say the same; what was read is printed."""
    Path("d.txt").write_text("# bench 3\nNr;weg;note\n1;90,8;a\n2;179,6;b\n")
    run = ("run", "--route", "adjoint", "--no-timing", "--no-store", "--problem")
    names, selector = "node=Nr,displacement=weg", "bar[data=d.txt,columns=node:Nr,displacement:weg,units=mm]"
    asked = cli(*run, "bar[data=d.txt]", "--columns", names, "--units", "mm")
    assert asked.code == 0, asked.err
    assert asked.out == cli(*run, selector).out
    said = "read node = Nr as given / displacement = weg in mm, factor 0.001 / not read: note"
    assert f"note: {selector}: {said}" in asked.out
    inverted = cli(
        *("invert", "--problem", "bar[data=d.txt]", "--columns", names, "--units", "mm", "--no-plot", "--no-store")
    )
    assert f"bar: {said}" in inverted.err


BAD = {
    "--units inch": "unit 'inch' is not known - the units are m, mm, um; Pa,",
    "--columns node=Nr": "no column Nr; it has node, displacement",
    "--columns node:a|b": "names with = or | cannot be part of a selector",
    "--columns 1,5": "--columns: is of --sensitivities",
}


@pytest.mark.parametrize("options", BAD)
def test_bad_columns_and_units_end_with_one_line(options: str, cli: Callable[..., Ran]) -> None:
    Path("d.csv").write_text("node,displacement\n1,90.8\n")
    run = ("run", "--route", "adjoint", "--no-timing", "--no-store", "--problem")
    ran = cli(*run, "bar[data=d.csv]", *options.split())
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert BAD[options] in ran.err
    none = cli(*run, "bar", "--units", "mm")
    assert (none.code, none.err) == (
        2,
        "routes: --units: no --problem reads a file - write --problem 'NAME[data=FILE]'\n",
    )


def test_a_quoted_separator_moves_no_column(file: File) -> None:
    path = file('remark,node,displacement\n"left, again",2,0.5\n"right, once",3,0.7\n')
    found = read_columns(path, ("node", "displacement"))
    np.testing.assert_array_equal(found["node"], [2.0, 3.0])
    np.testing.assert_array_equal(found["displacement"], [0.5, 0.7])


def test_a_mesh_in_mm_and_one_in_m_with_data_in_mm_are_one_problem(file: File, tmp_path: Path) -> None:
    """The points lie at the same places; without its unit the mesh is told to be a thousand times too large."""
    body = box_mesh("block", "hex8", (1, 1, 2), (1.0, 1.0, 1.0))
    name, cells = body.geometry.for_meshio()
    data = file("x [mm],y [mm],z [mm],ux (um),uz (um)\n100,200,900,3,4\n900,800,700,5,6\n")
    found = []
    for unit, scale in (("m", 1.0), ("mm", 1e3)):
        path = tmp_path / f"{unit}.vtu"
        meshio.Mesh(scale * body.geometry.X, [(name, cells)]).write(path)
        found.append(Block(mesh=str(path), mesh_unit=unit, law="linear", unknown="constants", data=data))
    one, other = found
    np.testing.assert_allclose(one.data.probes[0].N, other.data.probes[0].N, atol=1e-13)
    np.testing.assert_allclose(one.mesh.geometry.X, other.mesh.geometry.X, rtol=1e-15)
    told = Block(mesh=str(tmp_path / "mm.vtu"), law="linear", unknown="constants", data=data).notes
    assert "the points are in m beside a mesh in mm (mesh_unit=mm)?" in told
