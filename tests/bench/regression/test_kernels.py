"""make benchmark-regression: a slower machine is no regression, a slower route is one."""

from __future__ import annotations

import importlib
import json
from pathlib import Path

import pytest
from commands import ROOT, shell

from gradient_routes.problems.errors import InputError
from tests.benchmarks.kernels import FACTOR, Kernel, again, judge, of_session, read, typical, write

WORK = {"forward_solves": 1, "transposed_solves": 1}
BASELINE = ROOT / "tests" / "benchmarks" / "baseline.json"


def session(path: Path, machine: float = 1.0, works: dict[str, dict] | None = None, **slower: float) -> Path:
    """pytest-benchmark's JSON of three kernels on a machine `machine` times as slow."""
    seconds = {"adjoint": 1e-3, "tangent": 5e-3, "residual": 1e-5}
    benchmarks = [
        {
            "fullname": name,
            "stats": {"min": machine * slower.get(name, 1.0) * s},
            "extra_info": {"calibration_s": [machine * 1.1e-3, machine * 1e-3]}
            | ({} if name == "residual" else {"work": (works or {}).get(name, WORK)}),
        }
        for name, s in seconds.items()
    ]
    path.write_text(json.dumps({"benchmarks": benchmarks}))
    return path


@pytest.fixture
def base(tmp_path: Path):
    write(tmp_path / "baseline.json", of_session(session(tmp_path / "first.json")))
    return read(tmp_path / "baseline.json")


def worse(findings) -> list[tuple[str, str]]:
    return [(f.case["name"], f.metric) for f in findings if f.judgement == "worse"]


@pytest.mark.parametrize("machine", [1 / 3, 1.0, 3.0])
def test_a_machine_as_a_whole_slower_is_no_regression(tmp_path: Path, base, machine: float) -> None:
    assert {f.judgement for f in judge(base, of_session(session(tmp_path / "new.json", machine)))} == {"same"}


@pytest.mark.parametrize("machine", [1 / 3, 1.0, 3.0])
def test_a_route_twice_as_slow_is_one_on_any_machine(tmp_path: Path, base, machine: float) -> None:
    findings = judge(base, of_session(session(tmp_path / "new.json", machine, adjoint=2.0)))
    assert worse(findings) == [("adjoint", "time")]
    (found,) = [f for f in findings if f.judgement == "worse"]
    assert "x 2.00, limit x 1.6" in found.says


def test_the_limit_is_a_factor_on_both_sides(tmp_path: Path, base) -> None:
    for slower, judgement in ((0.99 * FACTOR, "same"), (1.01 * FACTOR, "worse"), (0.99 / FACTOR, "better")):
        new = of_session(session(tmp_path / "new.json", tangent=slower))
        assert [f.judgement for f in judge(base, new) if f.judgement != "same"] == [judgement] * (judgement != "same")


def test_work_is_exact_and_named(tmp_path: Path, base) -> None:
    more = {"adjoint": WORK | {"transposed_solves": 2}, "tangent": WORK | {"forward_solves": 0}}
    findings = judge(base, of_session(session(tmp_path / "new.json", works=more)))
    changed = {f.case["name"]: (f.judgement, f.says) for f in findings if f.judgement != "same"}
    assert changed == {
        "adjoint": ("worse", "transposed_solves 1 -> 2"),
        "tangent": ("better", "forward_solves 1 -> 0"),
    }


def test_a_benchmark_that_is_gone_or_counts_no_work_any_more_is_worse(base) -> None:
    new = {"tangent": Kernel(base["tangent"].ratio), "residual": base["residual"], "another": Kernel(1.0)}
    assert worse(judge(base, new)) == [("adjoint", "case"), ("tangent", "work")]
    assert [f.says for f in judge(base, new) if f.judgement == "shown"] == ["new"]


def test_measured_again_the_faster_counts_and_noise_is_no_regression(base) -> None:
    noisy = {**base, "adjoint": Kernel(3 * base["adjoint"].ratio, WORK)}
    assert worse(judge(base, noisy)) == [("adjoint", "time")]
    assert not worse(judge(base, again(noisy, {"adjoint": base["adjoint"]})))
    assert worse(judge(base, again(noisy, {"adjoint": noisy["adjoint"]})))


def test_a_baseline_is_the_median_of_its_sessions() -> None:
    sessions = [{"adjoint": Kernel(ratio, WORK)} for ratio in (1.0, 9.0, 2.0)]
    assert typical(sessions) == {"adjoint": Kernel(2.0, WORK)}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "No such file"),
        ("{", "is not a baseline of kernels"),
        ("[]", "is not a baseline of kernels"),
        ("{}", "is no baseline of kernels of version 1"),
        ('{"gradient-routes kernels": 2}', "is no baseline of kernels of version 1"),
        ('{"gradient-routes kernels": 1, "kernels": {"a": 3}}', "broken: TypeError"),
        ('{"gradient-routes kernels": 1, "kernels": {"a": {"ratio": 0}}}', "broken: ValueError: a ratio of 0"),
        ('{"gradient-routes kernels": 1, "kernels": {}}', "no kernel in it"),
    ],
)
def test_a_wrong_baseline_is_refused_in_one_line(tmp_path: Path, text: str | None, said: str) -> None:
    path = tmp_path / "baseline.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(InputError, match=r" - write it anew with `make benchmark-baseline`$") as refused:
        read(path)
    assert said in str(refused.value)


def test_a_session_that_measured_nothing_is_refused(tmp_path: Path) -> None:
    (tmp_path / "s.json").write_text('{"benchmarks": []}')
    with pytest.raises(InputError, match="no benchmark in it"):
        of_session(tmp_path / "s.json")


@pytest.mark.parametrize("name", ["stats", "extra_info"])
def test_a_benchmark_without_its_time_or_calibration_is_refused(tmp_path: Path, name: str) -> None:
    content = json.loads(session(tmp_path / "s.json").read_text())
    content["benchmarks"][1][name] = {}
    (tmp_path / "s.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"^\S+: a benchmark without its time or calibration: KeyError: .* - measure"):
        of_session(tmp_path / "s.json")


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(ROOT / "tests" / "benchmarks")
    return importlib.import_module("gate")


def test_a_report_of_benchmarks_that_are_all_gone_is_refused(gate, base, capsys) -> None:
    for known in (base, {}):
        with pytest.raises(InputError, match=rf"^of {len(known)} benchmarks in baseline.json none was measured - "):
            gate.report(judge(known, {"another": Kernel(1.0)}))
    assert capsys.readouterr().out == ""
    assert gate.report(judge(base, {"tangent": base["tangent"]})) == 1
    assert "a regression: 1 benchmarks" in capsys.readouterr().out


def test_the_committed_baseline_holds_every_route_with_its_work() -> None:
    kernels = read(BASELINE)
    routes = {name: kernel for name, kernel in kernels.items() if "bench_routes" in name}
    assert len(routes) >= 15
    assert all(kernel.work and kernel.work["forward_solves"] for kernel in routes.values())
    assert all(kernel.ratio > 0 for kernel in kernels.values())


def test_continuous_integration_runs_targets_that_exist() -> None:
    lines = (ROOT / ".ci/run").read_text().splitlines()
    steps = [line.removesuffix(" &") for line in lines if line.startswith("make ")]
    assert "make gate" in steps
    assert "make benchmark-regression FORM=--short" in steps
    done = shell(f"set -e; {'; '.join(step.replace('make', 'make --dry-run', 1) for step in steps)}", ROOT)
    assert done.returncode == 0, done.stderr
    assert ".ci/run" in (ROOT / ".github/workflows/ci.yml").read_text()


@pytest.mark.parametrize("machine", [1.0, 3.0])
def test_the_calibration_takes_longer_by_as_much_as_the_machine(monkeypatch: pytest.MonkeyPatch, machine) -> None:
    monkeypatch.syspath_prepend(ROOT / "tests" / "benchmarks")
    import calibration

    clock = iter(range(10**6))  # a tick a look: parts of one tick each, on a machine whose ticks are longer
    monkeypatch.setattr(calibration.time, "process_time", lambda: machine * next(clock))
    assert calibration.calibration() == pytest.approx(machine)
