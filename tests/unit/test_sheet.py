"""Numbers in words: errors keep two digits that count, chances that draws cannot tell from 0 are bounded."""

from html.parser import HTMLParser

import pandas as pd
import pytest
from campaigns import TINY, campaign, planted
from rigs import arm

import nnhydro
from nnhydro.sheet import Column, Sheet, p_text, percent


@pytest.mark.parametrize(("share", "text"), [(0.435, "43.5 %"), (0.0349, "3.5 %"), (0.0057, "0.57 %"), (0.0055, "0.55 %"),
                                             (0.006, "0.60 %"), (0.0004, "0.040 %"), (3e-7, "0.0 %"), (0.0, "0.0 %")])
def test_an_error_that_falls_is_not_said_to_stay(share, text):
    assert percent(share) == text


@pytest.mark.parametrize(("p", "draws", "text"), [(0.0342, None, "p = 0.034"), (0.0, None, "p < 0.001"), (0.0, 199, "p < 0.005")])
def test_a_chance_is_never_said_to_be_nothing(p, draws, text):
    assert p_text(p, draws) == text


class Balanced(HTMLParser):
    """Refuses HTML whose tags do not close in order."""

    def __init__(self):
        super().__init__()
        self.open, self.text = [], ""

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def text_of(html):
    """The words of the page, after checking that its tags close."""
    parser = Balanced()
    parser.feed(html)
    assert not parser.open
    return parser.text


@pytest.fixture(scope="module")
def healthy():
    a = arm()
    return campaign(a, planted(a), count=4, noise=0.01)


@pytest.fixture(scope="module")
def fitted(healthy):
    return nnhydro.identify(healthy, "constant")


@pytest.fixture(scope="module")
def compared(healthy):
    return nnhydro.benchmark(healthy, ["textbook", "constant"], folds=2)


def results(healthy, fitted, compared):
    run = healthy.load("run1")
    return {"Check": nnhydro.check(healthy), "Model": fitted, "Prediction": fitted.predict(run), "Benchmark": compared,
            "Catalogue": nnhydro.catalogue(), "network": nnhydro.train(healthy, TINY)}


@pytest.mark.slow
def test_every_result_says_its_verdict_as_text_in_a_notebook_and_as_a_frame(healthy, fitted, compared):
    for name, result in results(healthy, fitted, compared).items():
        sentence = result.verdict()
        assert sentence.endswith("."), name
        assert "\n" not in sentence, name
        assert repr(result).splitlines()[0] == f"{type(result).__name__}: {sentence}"
        assert sentence in text_of(result._repr_html_())
        frame = result.to_frame()
        assert isinstance(frame, pd.DataFrame)
        assert len(frame) > 0, name
        assert max(map(len, repr(result).splitlines())) < 400, name


def test_what_is_shown_is_escaped(healthy):
    a = arm().model_copy(update={"name": "<script>alert(1)</script>"})
    sheet = Sheet("<b>", (Column("<i>", ["<script>"], words=True),))
    assert "<script>" not in sheet.html()
    assert "<script>" in text_of(sheet.html())
    assert "<script>" in repr(nnhydro.Campaign.of(a, list(healthy.recordings())))


@pytest.mark.parametrize(("values", "cells"), [([0.5, None], ["50.0 %", ""]), ([(1, 2), None], None)])
def test_a_cell_without_a_value_is_empty(values, cells):
    column = Column("x", values, percent if cells else "{}")
    assert cells is None or column.cells() == cells
    assert len(Sheet("", (column,)).frame()) == 2
    assert Sheet("", (column,)).frame().iloc[1].isna().all()
