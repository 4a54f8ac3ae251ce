"""Every statement has its source and its page."""

from __future__ import annotations

import pytest
from commands import ROOT

from gradient_routes.bench.advice import statements
from gradient_routes.bench.advice.glossary import GLOSSARY
from gradient_routes.bench.advice.literature import SOURCES
from gradient_routes.bench.advice.statements import OF_ROUTES, Statement
from gradient_routes.bench.cases import registry

OTHERS = [value for value in vars(statements).values() if isinstance(value, Statement)]
CITING = [*GLOSSARY, *OF_ROUTES.values(), *OTHERS]


@pytest.mark.parametrize("entry", CITING, ids=lambda entry: getattr(entry, "name", entry.page))
def test_pages_and_sources_exist(entry) -> None:
    assert (ROOT / "docs" / entry.page).is_file()
    assert {*entry.sources} <= SOURCES.keys()


def test_every_source_is_cited_and_named_after_its_authors() -> None:
    assert {key for entry in CITING for key in entry.sources} == SOURCES.keys()
    for key, source in SOURCES.items():
        first = key.split()[0]
        assert first in source.authors.split(",")[0]
        assert key.endswith(str(source.year))
        assert source.link.startswith("https://")


def test_every_route_that_is_sound_has_a_statement() -> None:
    sound = {e.name for e in registry.registered("route") if e.origin == registry.BUILT_IN and e.sound}
    assert sound == OF_ROUTES.keys()


def test_terms_are_in_order_and_end_their_sentences() -> None:
    names = [term.name.lower() for term in GLOSSARY]
    assert names == sorted(set(names))
    assert all(term.meaning.endswith(".") for term in GLOSSARY)
