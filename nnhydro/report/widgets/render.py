"""Templates, style and script become one page that needs nothing but itself."""

from functools import lru_cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from nnhydro.report.figure_file import stroke
from nnhydro.report.widgets.residual_map import shade
from nnhydro.sheet import p_text

PLACE = "nnhydro.report.widgets"


@lru_cache(maxsize=1)
def _environment() -> Environment:
    made = Environment(loader=PackageLoader(PLACE, ""), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    made.filters["shade"] = shade
    made.filters["p_text"] = p_text
    made.filters["stroke"] = stroke
    return made


def _file(name: str) -> str:
    return (files(PLACE) / name).read_text(encoding="utf-8")


def render(template: str, **context: Any) -> str:
    """Return the page that `template` makes of `context`, style and script inside."""
    return _environment().get_template(template).render(style=_file("style.css"), script=_file("script.js"), **context)
