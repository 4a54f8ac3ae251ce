"""Every numeric option of every command has a range: what lies outside is refused in one line, before anything runs."""

from __future__ import annotations

import math
from collections.abc import Iterator

import click
import pytest
from click.testing import CliRunner

from gradient_routes.bench.cli import main
from gradient_routes.bench.ranges import Real, Whole
from gradient_routes.problems.errors import InputError

BAD = ("nan", "inf", "-inf", "-1", "0", "1e20", "100000000000000000000", "1e400", "1_0", "", "x", "9" * 5000)
# numbers that are more than one word to click: what reads them refuses the same
READ_AS_TEXT = {
    "--memory": ("nan", "inf", "-1", "0", "1e20GB", "1e400", "x"),
    "--affinity": ("nan", "-1", "1e20", "100000000000000000000", "x"),
}


def options() -> Iterator[tuple[str, click.Option]]:
    for name, command in main.commands.items():
        for parameter in command.params:
            if isinstance(parameter, click.Option):
                yield name, parameter


def kinds(option: click.Option) -> list[click.ParamType]:
    """The types of its words."""
    if isinstance(option.type, click.types.Tuple):
        return list(option.type.types)
    return [option.type] * option.nargs


NUMERIC = [(name, o) for name, o in options() if any(k.name.startswith(("int", "float")) for k in kinds(o))]
IDS = [f"{name} {option.opts[0]}" for name, option in NUMERIC]


def test_the_walk_finds_the_options() -> None:
    assert {"run --budget", "kink --points", "invert --alpha-sweep", "compare --factor", "check --seed"} <= {*IDS}
    assert len(IDS) > 80


@pytest.mark.parametrize(("command", "option"), NUMERIC, ids=IDS)
def test_every_numeric_option_has_a_range(command: str, option: click.Option) -> None:
    for kind in kinds(option):
        if isinstance(kind, Whole):
            assert kind.max is not None
            assert kind.max < 2**63
        else:
            assert isinstance(kind, Real | click.Path | click.Choice), f"{kind} has no range - take one of bench.ranges"


@pytest.mark.parametrize(("command", "option"), NUMERIC, ids=IDS)
def test_a_number_out_of_range_is_one_line(command: str, option: click.Option) -> None:
    """Whatever is taken is a number of the range; the rest is refused with what was given and what would be right."""
    for place, kind in enumerate(kinds(option)):
        refused = 0
        for text in BAD:
            words = [str(number) for number in good(option)]
            words[place] = text
            try:
                taken = kind.convert(text, option, None)
            except InputError:
                refused += 1
                said = invoked(command, option.opts[0], *words)
                shown = text[:40] or "''"
                assert said.startswith(f"routes: {option.opts[0]} {shown} - give ")
            else:
                assert not math.isnan(taken)
                assert math.isfinite(taken) or (text == "inf" and kind.endless)
                assert kind.min <= taken
        assert refused >= 5


@pytest.mark.parametrize("option", READ_AS_TEXT)
def test_numbers_in_texts_are_refused_too(option: str) -> None:
    for text in READ_AS_TEXT[option]:
        assert f"{option} {text}" in invoked("run", option, text, "--route", "adjoint", "--problem", "bar")


def invoked(command: str, *arguments: str) -> str:
    """stderr of a command that is wrong in these arguments."""
    ran = CliRunner().invoke(main, [command, *arguments])
    assert ran.exit_code == 2
    assert ran.stdout == ""
    assert ran.stderr.count("\n") == 1
    assert len(ran.stderr) < 200
    return ran.stderr


def good(option: click.Option) -> list[float]:
    """Words that it takes."""
    return [int(kind.min) if isinstance(kind, Whole) else _inside(kind) for kind in kinds(option)]


def _inside(kind: click.ParamType) -> float:
    assert isinstance(kind, Real)
    assert kind.min is not None
    return kind.min + (0.5 if kind.max is None or kind.max <= 1.0 else min(1.0, kind.max - kind.min) / 2)


def test_zero_is_allowed_where_it_means_something() -> None:
    allowed = {"min-time", "seed", "tolerance", "accept", "port"}
    for command, option in NUMERIC:
        name = option.opts[0].removeprefix("--")
        for kind in kinds(option):
            low = kind.min is not None and kind.min == 0 and not kind.min_open
            meant = name in allowed or (str(command), name) == ("invert", "iterations")  # 0: the start alone
            assert low == meant, f"{command} --{name}"


@pytest.mark.parametrize("partial", ["components", "directions"])
def test_more_components_than_parameters_are_refused(cli, partial: str) -> None:
    asked = ("run", "--problem", "bar", "--route", "adjoint", "--no-store", "--no-timing", f"--{partial}")
    assert cli(*asked, "8").code == 0
    if partial == "components":
        ran = cli(*asked, "9")
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
        assert "--components 9: bar has 8 parameters - take at most 8" in ran.err
