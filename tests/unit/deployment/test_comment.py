"""No text that comes from a file ends the comment of an exported file that it stands in."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest
from campaigns import GIVEN, planted
from hypothesis import given
from hypothesis import strategies as st
from rigs import arm

from nnhydro.deployment.c_header import header
from nnhydro.deployment.comment import comment_text
from nnhydro.deployment.formats.mujoco import mujoco_xml
from nnhydro.deployment.step import record_step
from nnhydro.models.strip_theory import StripTheory

HOSTILE = 'x */ int hidden(void) { return 1; } /* y --> <include file="z"/> <!-- \x1b[2J'


@given(st.text(alphabet="*/-<>! \\\n\x1b?a", max_size=12))
def test_no_text_holds_what_begins_or_ends_a_comment(text):
    made = comment_text(text)
    assert not any(mark in made for mark in ("*/", "/*", "--", "\x1b"))
    assert made.replace(" ", "").replace("\N{REPLACEMENT CHARACTER}", "\x1b") == text.replace(" ", ""), "nothing is lost"


@pytest.mark.parametrize("text", ["C_D(s/D) of 3 - 4 strips", "a*b"])
def test_plain_text_stays_as_it_is(text):
    assert comment_text(text) == text


@pytest.fixture(scope="module")
def model():
    return StripTheory(arm(2), GIVEN, {}, HOSTILE, planted(arm(2)))


def test_the_header_is_code_where_it_was_code_before(model):
    plain, hostile = (header(record_step(m), "arm", "double", "", (HOSTILE,) * (m is model))
                      for m in (replace(model, name="constant"), model))
    assert hostile.partition("*/\n#ifndef")[2] == plain.partition("*/\n#ifndef")[2] != ""
    assert hostile.index("*/") == hostile.index("*/\n#ifndef"), "the first comment ends where the code begins"


def test_the_mujoco_xml_is_well_formed_and_holds_nothing_more(model):
    made, plain = (ET.fromstring(mujoco_xml(m).xml) for m in (model, replace(model, name="constant")))
    assert [e.tag for e in made.iter()] == [e.tag for e in plain.iter()]
