"""A page needs nothing but itself, believes no text, and a template that lacks a value is a fault."""

import pytest
from jinja2 import DictLoader, UndefinedError

from nnhydro.report.widgets.render import _environment, _file, render


@pytest.fixture
def template(monkeypatch):
    """A way to render a template given as text."""
    def made(text, **context):
        monkeypatch.setattr(_environment(), "loader", DictLoader({text: text}))
        return render(text, **context)

    return made


def test_style_and_script_are_inside(template):
    assert template("{{ style|safe }}|{{ script|safe }}") == f"{_file('style.css')}|{_file('script.js')}"
    assert "@import" not in _file("style.css")
    assert "url(" not in _file("style.css")


def test_text_is_escaped_and_a_missing_value_is_a_fault(template):
    assert template("{{ name }}", name="<b> & 'c'") == "&lt;b&gt; &amp; &#39;c&#39;"
    with pytest.raises(UndefinedError, match="nmae"):
        template("{{ nmae }}", name="x")


def test_filters_of_the_pages_are_there(template):
    assert template("{{ v|shade }},{{ p|p_text }},{{ 0|stroke }}", v=1.0, p=0.0).split(",")[0] == "hi"
    assert "var(--c1)" in template("{{ 1|stroke }}")
