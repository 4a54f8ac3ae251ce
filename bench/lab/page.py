"""What is around a part: its title, links to the others, the command and how it stands."""

from __future__ import annotations

from functools import cache
from html import escape
from importlib.resources import files

import panel as pn
from bokeh.document import Document
from jinja2 import Template
from panel.io.location import Location

from gradient_routes.bench.lab.part import Part
from gradient_routes.bench.lab.parts import PARTS, load


@cache
def text(name: str) -> str:
    """A file beside this one."""
    return files("gradient_routes.bench.lab").joinpath(name).read_text(encoding="utf-8")


def inside(part: Part) -> pn.Column:
    """The part with its command and its state, below unless it shows them itself, for a page or a notebook."""
    content = part.content()
    shown = content.select()
    below = [pane for pane in (part.status, part.shown) if pane not in shown]
    column = pn.Column(content, *below, sizing_mode="stretch_width")
    for seen in column.select(lambda part: isinstance(part, pn.pane.HTML | pn.widgets.Widget)):
        seen.stylesheets = [*seen.stylesheets, text("inside.css")]
    return column


class Whole(pn.Template):
    """A page whose models are counted once, not after every one of them."""

    def server_doc(
        self, doc: Document | None = None, title: str | None = None, location: bool | Location = True
    ) -> Document:
        with (doc or pn.state.curdoc).models.freeze():
            return super().server_doc(doc, title, location)


def page(part: Part) -> pn.Template:
    """The whole page of a part."""
    template = Whole(text("page.html"), location=True)
    for name, value in {
        "css": text("lab.css"), "js": text("page.js"), "here": part.slug, "lead": part.lead, "heading": part.title,
        "parts": [(slug, load(slug).title) for slug in PARTS],
    }.items():  # fmt: skip
        template.add_variable(name, value)
    template.add_panel("part", inside(part))
    return template


def overview() -> str:
    """The first page: what there is."""
    cards = "".join(
        f'<a href="/{slug}"><h2>{escape(load(slug).title)}</h2><p>{escape(load(slug).lead)}</p></a>' for slug in PARTS
    )
    return str(Template(text("overview.html"), autoescape=False).render(css=text("lab.css"), cards=cards))
