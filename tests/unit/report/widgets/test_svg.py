"""Pieces of SVG believe no text, and bars and intervals end where their numbers say."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from nnhydro.report.widgets.svg import NAMES, RIGHT, WIDTH, Scale, around, bars, intervals, tag, words


def of_kind(drawing, name, kind):
    """The elements of a class."""
    return [element for element in ET.fromstring(drawing).iter(name) if element.get("class") == kind]


def test_everything_in_an_element_is_escaped_but_elements_are():
    inner = tag("b", "<i> & co")
    assert tag("a", inner, class_="x", aria_label='"y" <z>', none=None) == (
        '<a class="x" aria-label="&#34;y&#34; &lt;z&gt;"><b>&lt;i&gt; &amp; co</b></a>')
    assert tag("line", x1=1 / 3, x2=2) == '<line x1="0.33333" x2="2"/>'
    assert words("<script>", 1, 2).count("<") == 2


def test_limits_hold_what_is_finite_with_a_little_room_and_zero_where_asked():
    values = np.array([1.0, np.nan, 3.0, np.inf])
    assert around(values) == pytest.approx((0.9, 3.1))
    assert around(values, zero=True) == pytest.approx((-0.15, 3.15))
    assert around(-values, zero=True) == pytest.approx((-3.15, 0.15))
    assert around(np.array([4.0])) == (2.0, 6.0), "of one value"
    assert around(np.array([0.0])) == (-1.0, 1.0)
    assert around(np.array([np.nan])) == pytest.approx((-0.05, 1.05))


def test_a_scale_takes_ends_to_ends_also_upside_down():
    assert [Scale(-1, 3, 100, 0)(value) for value in (-1, 1, 3)] == [100, 50, 0]


def test_a_bar_is_as_long_as_its_weight():
    drawing = bars("weights", [("a", 1.0), ("b", 0.5), ("<c>", 0.0)])
    whole, half, none = (float(bar.get("width")) for bar in of_kind(drawing, "rect", "weight"))
    assert whole == WIDTH - RIGHT - NAMES - 10
    assert (half, none) == (whole / 2, 0)


def test_an_interval_holds_its_value_and_shows_zero():
    drawing = intervals("numbers", [("a", 2.0, (1.0, 3.0), "N m"), ("b", -2.0, (-3.0, -1.0), "1")])
    kinds = (("line", "axis"), ("line", "m0 bar"), ("circle", "m0 dot"))
    for axis, bar, dot, side in zip(*(of_kind(drawing, *kind) for kind in kinds), (1, -1), strict=True):
        low, high, at = float(bar.get("x1")), float(bar.get("x2")), float(dot.get("cx"))
        assert at == pytest.approx((low + high) / 2, abs=0.1)
        assert side * (low - float(axis.get("x1"))) > 0 < high - low
    texts = [text.text for text in of_kind(drawing, "text", "value")]
    assert texts == ["2 (1 to 3) N m", "-2 (-3 to -1) "]
