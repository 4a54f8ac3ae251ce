"""`routes vcurve` and `routes check` as they are typed: what they print, keep and return."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from commands import ROOT, shell

from gradient_routes.bench.store.store import Store

EXAMPLES = ROOT / "examples" / "check"
KEYS = (
    "verdict floor best_step slope_one_sided slope_central noise plateau tightened_plateau culprit worst_components"
    " calls"
).split()


def verdict(ran) -> dict:
    (answer,) = ran.rows
    return answer


# --- V-curves


def test_the_bars_v_curve_is_as_the_textbook_draws_it(cli) -> None:
    ran = cli("vcurve", "--problem", "bar", "--route", "adjoint", "--json")
    answer = verdict(ran)
    assert (ran.code, ran.err, answer["verdict"]) == (0, "", "agrees")
    assert set(KEYS) <= answer.keys()
    assert answer["floor"] <= 1e-10
    assert answer["slope_central"] == pytest.approx(2.0, abs=0.1)
    assert answer["slope_one_sided"] == pytest.approx(1.0, abs=0.1)
    assert answer["roundoff_slope"] == pytest.approx(-1.0, abs=0.2)
    assert 1e-7 < answer["best_step"] < 1e-4  # about cbrt(eps)
    names, records = Store("results/routes.sqlite").table("points")
    rows = [dict(zip(names, record, strict=True)) for record in records]
    lines = Counter(row["line"] for row in rows)
    assert lines == {"random direction 1": 65, "log E_3": 65, "random direction 2": 65, "at a second point": 9}
    one_sided = min(row["error_one_sided"] for row in rows if row["line"] == "log E_3" and row["error_one_sided"])
    assert 1e-10 < one_sided < 1e-7
    for table in ("checks", "points", "studies"):
        assert cli("export", "--table", table, "-o", f"{table}.csv").code == 0


def test_the_blocks_v_curve_reaches_nine_digits(cli) -> None:
    sweep = ("--steps", "1e-9", "1e-2", "--per-decade", "2", "--components", "1", "--directions", "1")
    answer = verdict(cli("vcurve", "--problem", "block[n=2]", "--route", "adjoint", *sweep, "--json"))
    assert answer["verdict"] == "agrees"
    assert answer["floor"] <= 1e-9


@pytest.mark.parametrize("verb", ["vcurve", "check"])
@pytest.mark.parametrize("stop", ["penalty", "multiplier"])
@pytest.mark.parametrize(("s", "code", "says"), [(1.25, 3, "non-smooth"), (1.1, 0, "agrees"), (1.4, 0, "agrees")])
def test_a_kink_is_told_from_its_branches(cli, tmp_path: Path, verb: str, stop: str, s: float, code: int, says: str):
    """The tip of a bar of E = s leaves the stop at s = 1.25 = F L / (A gap)."""
    (tmp_path / "p.csv").write_text("p\n" + f"{np.log(s)!r}\n".replace("np.float64(", "").replace(")", "") * 8)
    ran = cli(verb, "--problem", f"bar[stop={stop}]", "--route", "adjoint", "--at", "p.csv", "--json")
    answer = verdict(ran)
    assert (ran.code, answer["verdict"]) == (code, says)
    assert (answer["active_set_changes"] >= 1) == (says == "non-smooth")


@pytest.mark.parametrize(("components", "lines"), [("2", 2), ("2,5..7", 4), ("1,1", 1)])
def test_components_are_a_number_or_a_list(cli, components: str, lines: int) -> None:
    cli("vcurve", "--problem", "bar", "--route", "adjoint", "--components", components, "--json")
    names, records = Store("results/routes.sqlite").table("points")
    seen = {record[names.index("line")] for record in records}
    assert len([line for line in seen if line.startswith("log E")]) == lines


def test_a_verdict_is_shown_with_its_curve_and_evidence(cli) -> None:
    out = cli("vcurve", "--problem", "bar", "--route", "faulty-adjoint[fault=sign]").out
    first = out.splitlines()[0]
    assert first == "faulty-adjoint on bar: wrong-gradient"
    for part in ("next: look at the sign of lam", "1 one-sided   2 central", "t tightened x 0.001", "adjoint residual"):
        assert part in out


def test_a_long_sweep_is_refused_with_its_bill(cli) -> None:
    ran = cli("vcurve", "--problem", "block[n=2]", "--route", "adjoint", "--budget", "1e-3", "--no-store")
    assert (ran.code, ran.out) == (2, "")
    assert "forward solves are predicted to take" in ran.err
    assert "--budget inf" in ran.err


def test_a_page_is_written(cli, tmp_path: Path) -> None:
    ran = cli("vcurve", "--problem", "bar", "--route", "faulty-adjoint[fault=factor]", "--html", "page.html", "--json")
    assert ran.code == 1
    page = (tmp_path / "page.html").read_text()
    assert "wrong-gradient" in page
    assert len(set(re.findall(r'"(along [^"\\]+)"', page))) == 3
    library = max(re.findall(r"<script>.*?</script>", page, re.DOTALL), key=len)
    assert not re.search("https?:", page.replace(library, "")), "a page needs nothing else"
    assert "default-src 'none'" in page


@pytest.mark.parametrize("route", ["adjoint", "tangent"])
def test_a_minimum_with_perfect_data_is_no_mistake(cli, route: str) -> None:
    assert cli("check", "--problem", "bar", "--route", route, "--at", "true", "--no-store").code == 0


# --- other people's code


@pytest.mark.parametrize(
    ("target", "code", "says"),
    [("dropped_sign.py:Poisson", 1, "wrong-gradient"), ("jax_function.py:Pendulums", 0, "agrees")],
)
def test_the_worked_examples(cli, target: str, code: int, says: str) -> None:
    """The README runs the other two, which start a program at every call (test_documents)."""
    ran = cli("check", f"{EXAMPLES}/{target}", "--json", "--no-store")
    assert (ran.code, ran.err) == (code, "")
    answer = verdict(ran)
    assert answer["verdict"] == says
    assert answer["calls"] <= 200
    if code == 1:
        assert answer["culprit"] == "the whole gradient, off by its sign"


def test_the_pytorch_example(tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="PyTorch is not installed")
    done = shell(f"routes check {EXAMPLES}/torch_module.py:Loss --json --no-store", tmp_path)
    assert (done.returncode, json.loads(done.stdout)["verdict"]) == (0, "agrees")


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    path = tmp_path / "mine.py"
    path.write_text(
        "import numpy as np\n"
        "from beside import scale\n"
        "def J(p): return float((scale * p**2).sum())\n"
        "def dJ(p): return 2.0 * scale * p\n"
        "def bad(p): return scale * p\n"
        "class Both:\n"
        "    start = np.ones(3)\n"
        "    objective, gradient = staticmethod(J), staticmethod(dJ)\n"
        "def needs(argument): pass\n"
        "nothing = 3\n"
    )
    (tmp_path / "beside.py").write_text("scale = 3.0\n")
    (tmp_path / "p.csv").write_text("p\n1\n2\n3\n")
    return path


def test_two_functions_and_a_point(cli, mine: Path) -> None:
    functions = ("--objective", "mine.py:J", "--at", "p.csv", "--json", "--gradient")
    assert cli("check", *functions, "mine.py:dJ").code == 0
    ran = cli("check", *functions, "mine.py:bad")
    assert ran.code == 1
    assert verdict(ran)["culprit"] == "the whole gradient, off by the factor 0.5"
    names, records = Store("results/routes.sqlite").table("checks")
    assert [record[names.index("verdict")] for record in records] == ["agrees", "wrong-gradient"]


def test_an_object_at_another_point(cli, mine: Path) -> None:
    assert cli("check", "mine.py:Both", "--at", "p.csv", "--no-store").code == 0


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("", "nothing to check"),
        ("mine.py:Both --problem bar --route adjoint", "a target and --problem or --route given"),
        ("--objective mine.py:J --at p.csv", "go together"),
        ("--objective mine.py:J --gradient mine.py:dJ", "have no start"),
        ("nowhere.py:Both", "no file nowhere.py here"),
        ("mine.py:Bth", "did you mean 'Both'?"),
        ("mine.py:nothing", "has no objective(p) and gradient(p)"),
        ("mine.py:needs", "wants arguments"),
        ("no.such.module:Both", "cannot be imported: ModuleNotFoundError"),
        ("mine.py", "write FILE.py:NAME"),
        ("mine.py:Both --budget 5", "give at least 20"),
        ("mine.py:Both --rtol 1e-3", "--rtol: is for registered problems"),
        ("--problem bar --html page.html", "--html: is for verdicts"),
        ("mine.py:Both --accept 2", "give a number >= 0 and < 1"),
        ("mine.py:Both --at nowhere.csv", "nowhere.csv: cannot be read"),
        ("mine.py:Both --html no/such/folder.html", "--html no/such/folder.html"),
        ("--problem bar --route barr", "no route 'barr'"),
        ("--problem bar|block --route adjoint", "no problem 'bar|block'"),
        ("--problem bar[n=2|3] --route adjoint", "names 2 problems"),
        ("--problem bar --route all", "names 7 routes"),
    ],
)
def test_wrong_usage_is_one_line(cli, mine: Path, arguments: str, says: str) -> None:
    ran = cli("check", *arguments.split())
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err
    assert not Path("results").exists(), "nothing was measured: nothing is kept"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("--steps 1 1e-16", "give 0 < least < largest"),
        ("--steps 1e-8 1e-7", "3 decades apart"),
        ("--per-decade 1", "give a whole number from 2 to 100"),
        ("--components x", "write 3 (how many) or 2,5..7 (which)"),
        ("--components 0,9", "there are 1 to 8"),
        ("--components 1..99999999999", "there are 1 to 8"),
        ("--components 5..2", "there are 1 to 8"),
        ("--components 9", "there are 1 to 8"),
        ("--directions 0", "give a whole number from 1"),
        ("--budget 0", "give seconds > 0"),
        ("--rtol 2", "give a number > 0 and < 1"),
        ("--seed -1", "give a whole number from 0"),
        ("--at true.csv", "cannot be read"),
    ],
)
def test_wrong_usage_of_vcurve_is_one_line(cli, arguments: str, says: str) -> None:
    ran = cli("vcurve", "--problem", "bar", "--route", "adjoint", *arguments.split())
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err


# --- contracts


def test_registered_problems_keep_their_contract(cli) -> None:
    for problem in ("bar", "bar[stop=multiplier]", "advection[n=3]"):
        ran = cli("check", "--problem", problem)
        assert ran.code == 0, ran.out
        assert "keeps the contract" in ran.out
        assert "adjoint: counted work is the declared work" in ran.out


def test_what_a_program_prints_stays_off_stdout(tmp_path: Path) -> None:
    (tmp_path / "loud.py").write_text(
        "import subprocess\nprint('imported')\nclass Loud:\n    start = [1.0, 2.0]\n"
        "    def value_and_gradient(self, p):\n        subprocess.run(['echo', 'solving'])\n"
        "        return float(p @ p), 2 * p\n"
    )
    done = shell("routes check loud.py:Loud --json --no-store", tmp_path)
    assert json.loads(done.stdout)["verdict"] == "agrees"
    assert "solving" in done.stderr


def test_a_file_is_run_once(cli, mine: Path) -> None:
    counting = (
        "from pathlib import Path\nruns = Path('runs')\nruns.write_text(f'{runs.exists() and runs.read_text()}x')\n"
    )
    mine.write_text(mine.read_text() + counting)
    cli("check", "--objective", "mine.py:J", "--gradient", "mine.py:dJ", "--at", "p.csv", "--no-store")
    assert (mine.parent / "runs").read_text() == "Falsex"


SPRING = """
import numpy as np
from gradient_routes.problems.problem import Linearization, Offers, Parameters, Problem

class Spring(Problem):
    name, structure, linear, n_state = "spring", "spd", True, 2
    offers = Offers.LINEARIZE | Offers.COMPLEX
    def __init__(self):
        self.parameters = Parameters(start=np.array([1.0, 2.0]), scale=np.ones(2), lower=0.0)
    def residual(self, u, p): return p * u - 1.0
    def tangent(self, u, p): return np.diag(p)
    def objective(self, u, p): return 0.5 * np.sum((u - 0.3) ** 2)
    def linearize(self, u, p): return Linearization(np.diag(u), u - 0.3, np.zeros(2))
"""


@pytest.mark.parametrize(
    ("break_it", "says"),
    [
        (("", ""), None),
        (("np.diag(u), u", "np.diag(u * [1.0, 2.0]), u"), "dR/dp, parameter p_2, off by the factor 2"),
        (("u - 0.3, np", "u - 0.2, np"), "J_u"),
        (("np.diag(p)", "np.diag(p) + [[0, 1.0], [0, 0]]"), "R_u"),
        (("np.zeros(2))", "np.zeros(3))"), "J_p has the shape (3,), not (2,)"),
        (("lower=0.0", "lower=1.5"), "outside 1.5 < p_1"),
        (("p * u - 1.0", "p * u + u**3 - 1.0"), "R_u"),
        (("return p * u - 1.0", "return (p * u - 1.0)[:1]"), "R (1,): n_state says (2,)"),
        (("return p * u - 1.0", "return np.linalg.nothing"), "AttributeError"),
        (("(u - 0.3) ** 2", "abs(u - 0.3) ** 2"), "objective keeps imaginary parts (COMPLEX)"),
        (("return p * u - 1.0", "return p.real * u - 1.0"), "residual keeps imaginary parts (COMPLEX)"),
    ],
)
def test_a_broken_promise_is_named(cli, tmp_path: Path, break_it: tuple[str, str], says: str | None) -> None:
    (tmp_path / "my.py").write_text(SPRING.replace(*break_it))
    ran = cli("check", "--problem", "my.py:Spring")
    assert ran.code == (0 if says is None else 1 if "outside" not in says else 2)
    assert (says or "keeps the contract") in ran.out + ran.err


CHAIN = """
import numpy as np
from gradient_routes.problems.problem import Linearization, Offers, Parameters, Problem

class Chain(Problem):
    name, structure, n_state = "chain", "spd", 8
    offers = Offers.LINEARIZE | Offers.COMPLEX
    D = np.eye(8) - np.eye(8, k=-1)
    def __init__(self):
        self.parameters = Parameters(start=np.linspace(1.0, 2.0, 8), scale=np.ones(8), lower=0.0)
    def residual(self, u, p): return self.D.T @ (p.real * (self.D @ u)) + 0.1 * u**3 - 1.0
    def tangent(self, u, p): return self.D.T @ np.diag(p) @ self.D + np.diag(0.3 * u**2)
    def objective(self, u, p): return 0.5 * np.sum((u - 0.3) ** 2)
    def linearize(self, u, p): return Linearization(self.D.T @ np.diag(self.D @ u), u - 0.3, np.zeros(8))
"""
LOST = "chain: complex step lost: residual drops Im p, off a difference by 1 - use no abs, conj, real, float"


def test_a_broken_promise_of_complex_steps_is_one_violation(cli, tmp_path: Path) -> None:
    """All else is tested by differences, and complex steps are not run."""
    (tmp_path / "my.py").write_text(CHAIN)
    ran = cli("check", "--problem", "my.py:Chain", "--json")
    assert ran.code == 1
    findings = verdict(ran)["findings"]
    (broken,) = [f for f in findings if f["sound"] is False]
    assert broken["name"] == "residual keeps imaginary parts (COMPLEX)"
    assert broken["says"] == "drops Im p, off a difference by 1"
    names = {f["name"] for f in findings}
    assert {"dR/dp against central difference of R", "J_u against complex step of J"} <= names
    assert not any(name.startswith("complex-step:") for name in names)
    assert any(name.startswith("adjoint:") for name in names)


@pytest.mark.parametrize("route", ["adjoint", "fd-central"])
def test_lost_imaginary_parts_say_nothing_of_a_gradient(cli, tmp_path: Path, route: str) -> None:
    (tmp_path / "my.py").write_text(CHAIN)
    ran = cli("check", "--problem", "my.py:Chain", "--route", route, "--json")
    answer = verdict(ran)
    assert (ran.code, ran.err, answer["verdict"], answer["next"]) == (0, "", "agrees", "use the gradient")
    (complex_step,) = [f for f in answer["findings"] if f["name"] == "complex step"]
    assert (complex_step["sound"], complex_step["says"]) == (None, LOST)


def test_rows_are_judged_by_another_and_say_why(cli, tmp_path: Path) -> None:
    (tmp_path / "my.py").write_text(CHAIN)
    routes = [part for name in ("adjoint", "fd-central", "complex-step") for part in ("--route", name)]
    ran = cli("run", "--problem", "my.py:Chain", *routes, "--json", "--no-timing")
    adjoint, differences, refused = ran.rows
    for row in (adjoint, differences):
        assert (row["reference"], row["note"]) == ("tangent", f"{row['route']}: {LOST}")
    assert adjoint["gradient_error"] < 1e-12
    assert differences["gradient_error"] < 1e-6
    assert adjoint["work"]["forward_solves"] == 1
    assert (refused["status"], refused["reason"]) == ("failed", LOST)


def test_a_route_of_a_file_is_held_to_its_declared_work(cli, tmp_path: Path) -> None:
    source = (ROOT / "examples" / "plugin" / "duffing" / "route.py").read_text()
    (tmp_path / "mine.py").write_text(source)
    assert cli("check", "--route", "mine.py:fd_extrapolated").code == 0
    (tmp_path / "cheap.py").write_text(source.replace("4 * n_p", "n_p"))
    ran = cli("check", "--route", "cheap.py:fd_extrapolated", "--json")
    assert ran.code == 1
    (said,) = [f["says"] for f in verdict(ran)["findings"] if f["sound"] is False]
    assert "forward_solves counted 32, declared 8" in said
    assert cli("check", "--problem", "bar", "--route", "mine.py:fd_extrapolated", "--no-store").code == 0
