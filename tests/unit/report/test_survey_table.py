"""The survey of a campaign as sheets and JSON: what counts in the verdict, what stands in each row."""

import json

import numpy as np
from planted import campaign

from nnhydro.cli.terminal.survey import oddity_lines
from nnhydro.recordings.checks.oddity import Oddity
from nnhydro.recordings.survey import Entry, LinkFacts, Survey, survey
from nnhydro.report.survey_table import document, oddities_sheet, plural, recordings_sheet, tips_sheet, verdict

ODD = Oddity("run1", "warning", "q1_rad", "something", "do something", "a")
OTHER = Oddity("run1", "warning", "q2_rad", "x", "y", "b")
NOTE = Oddity(None, "note", "", "few rows", "record more", "c")
WRONG = Oddity("run2", "error", "t_s", "goes back", "sort the rows", "d")


def entry(name, **facts):
    """A recording of 100 rows in 2 s."""
    return Entry(**{"name": name, "rows": 100, "duration_s": 2.0, "rate_hz": 50.0, "jitter": 0.0, "given": ("q", "tau"), "derived": (),
                    "steps": ()} | facts)


def looked_over(*oddities, entries=(), links=()):
    """A survey that found these."""
    return Survey(tuple(entries), (("tows", 7),), oddities, None, None, tuple(links))


def test_a_single_warning_is_counted_in_the_singular():
    assert verdict(looked_over(ODD)) == "Usable, but resolve the warning first: it affects every fit."
    assert verdict(looked_over(ODD, OTHER)) == "Usable, but resolve the 2 warnings first: they affect every fit."
    assert [plural(n, "run") for n in (0, 1, 2)] == ["0 runs", "1 run", "2 runs"]


def test_the_verdict_counts_kinds_of_warnings_as_they_are_printed():
    def clipped(c):
        return {"tau1_Nm": np.clip(c["tau1_Nm"], 0.6 * c["tau1_Nm"].min(), 0.6 * c["tau1_Nm"].max())}

    found = survey(campaign(clipped, in_all=True))
    printed = sum(line.startswith("warning") for line in oddity_lines(found.oddities))
    assert 0 < printed < len(found.oddities)
    assert f" {printed} warning" in verdict(found)


def test_an_error_outweighs_warnings_and_a_note_asks_for_nothing():
    assert verdict(looked_over(ODD, WRONG, NOTE)) == "Not usable: 1 error. Correct the first and check again."
    assert verdict(looked_over(NOTE)) == "Usable: nothing looks wrong (1 note)."
    assert verdict(looked_over()) == "Usable: nothing looks wrong."


def test_each_recording_stands_with_the_number_of_its_own_oddities():
    found = looked_over(ODD, OTHER, WRONG, NOTE, entries=[entry("run1"), entry("run2", derived=("dq", "ddq")), entry("run3")])
    sheet = recordings_sheet(found, 2)
    assert sheet.title == "3 recordings", "all are counted, where the first alone are shown"
    columns = {column.heading: column.cells() for column in sheet.columns}
    assert columns["recording"] == ["run1", "run2"]
    assert columns["oddities"] == ["2", "1"]
    assert columns["derived"] == ["-", "dq ddq"]
    assert columns["cut-off Hz"] == ["", ""]
    assert oddities_sheet(found).rows()[2] == ["error", "d", "run2", "run2: t_s: goes back: sort the rows"]


def test_a_dry_arm_has_tips_without_a_reynolds_number():
    wet, dry = LinkFacts(9.0, 1.5, 1.2e5, 4.0), LinkFacts(9.0, 1.5, None, 4.0)
    assert tips_sheet(looked_over(links=[wet])).title == "How the tips move through the fluid"
    assert tips_sheet(looked_over(links=[wet])).rows() == [["1", "9", "1.5", "1.2e+05", "4"]]
    assert tips_sheet(looked_over(links=[dry])).title == "How the tips move (a dry arm)"
    assert tips_sheet(looked_over(links=[dry])).rows() == [["1", "9", "1.5", "", "4"]]


def test_json_holds_the_survey_and_no_number_that_json_cannot():
    made = document(looked_over(WRONG, entries=[entry("run2", rate_hz=float("nan")), entry("run3")]), "tank")
    assert json.loads(json.dumps(made, allow_nan=False))["usable"] is False
    assert [r["rate_hz"] for r in made["recordings"]] == [None, 50.0]
    assert made["steady"] == [{"name": "tows", "runs": 7}]
    assert made["low_pass"] is made["rates_from"] is made["noise_floor"] is None
    assert document(looked_over(ODD), "tank")["usable"] is True
