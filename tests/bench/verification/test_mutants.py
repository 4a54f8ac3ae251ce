"""The sample of `make mutants`: fixed, spread over all areas, and made of programs that compile."""

from __future__ import annotations

import ast
import tomllib
from collections import Counter
from pathlib import Path

import pytest

from benchmarks import mutants
from benchmarks.mutants import AREAS, EACH, REASONS, ROOT, Mutant, sample


@pytest.fixture(scope="module")
def chosen() -> list[Mutant]:
    return sample()


def test_the_sample_is_fixed_of_every_area_and_of_other_programs(chosen: list[Mutant]) -> None:
    assert chosen == sample() != sample(seed=1)
    assert Counter(m.area for m in chosen) == dict.fromkeys(AREAS, EACH)
    assert len({m.id for m in chosen}) == len(chosen)
    for mutant in chosen:
        source = (ROOT / mutant.file).read_bytes()
        assert ast.dump(ast.parse(mutant.apply(source))) != ast.dump(ast.parse(source)), mutant.id


def test_ids_do_not_depend_on_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    path = tmp_path / "f.py"
    path.write_text("def f(x):\n    return not x ** 2 < 1.5 and True\n")
    before = list(mutants.mutants("problems", path))
    path.write_text('"""Later."""\n\n' + path.read_text())
    assert [m.id for m in mutants.mutants("problems", path)] == [m.id for m in before]
    changes = {m.id.partition("f.py:f:")[2]: str(m.change) for m in mutants.mutants("problems", path)}
    assert changes["exponent:1"] == "x ** 2 -> (x ** (2 + 1))"
    assert changes["comparison:1"].endswith("(x ** 2 <= 1.5)")
    assert changes["constant:2"] == "1.5 -> (15.0)"
    assert {"not:1", "return:1", "boolean:1", "boolean:2", "constant:1"} <= changes.keys()


def test_every_reason_is_of_a_mutant_in_the_sample(chosen: list[Mutant]) -> None:
    assert tomllib.loads(REASONS.read_text()).keys() <= {m.id for m in chosen}
