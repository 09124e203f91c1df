"""What `nnhydro check` prints: one line a kind of finding, and the command that comes next."""

from dataclasses import replace

from campaigns import campaign, planted
from rigs import arm

from nnhydro.cli.terminal.survey import next_steps, oddity_lines, print_survey
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import Oddity
from nnhydro.recordings.survey import survey

A = arm(1)
GOOD = survey(campaign(A, planted(A), 3, seconds=4.0, rate=100.0))


def odd(recording, severity="warning", check="gaps"):
    return Oddity(recording, severity, "t_s", "has a gap", "record again", check)


def test_findings_of_one_kind_are_one_line_that_names_where_else():
    (line,) = oddity_lines([odd(f"run{k}") for k in range(6)])
    assert line.startswith("warning")
    assert line.endswith("(also in run1, run2, run3 and 2 more)")
    assert len(oddity_lines([odd("a"), odd("b", check="clock")])) == 2
    assert "also in" not in oddity_lines([odd("a")])[0]


def test_what_looks_wrong_is_mended_before_anything_is_compared():
    assert next_steps(replace(GOOD, oddities=(odd("run0"),)), "tank") == "correct what is named above, then nnhydro check tank"
    assert next_steps(replace(GOOD, oddities=(odd("run0", "note"),)), "tank") == "nnhydro benchmark tank --out compared"
    assert next_steps(replace(GOOD, oddities=(), entries=GOOD.entries[:1]), "tank").startswith("nnhydro identify tank")


def test_a_machine_that_nothing_drives_is_diagnosed_and_neither_compared_nor_trained():
    whole = campaign(A, planted(A), 3, seconds=2.0, rate=50.0)
    free = [replace(whole.load(name), tau=0 * whole.load(name).tau) for name in whole.names]
    assert next_steps(survey(Campaign.of(A, free)), "ship").startswith("nnhydro diagnose ship")
    one_driven = survey(Campaign.of(A, [*free, replace(whole.load("run0"), name="driven")]))
    assert not one_driven.undriven


def test_a_long_campaign_is_counted_and_its_verdict_is_printed_last_but_one(capsys):
    many = survey(Campaign.of(A, [replace(campaign(A, planted(A), 1, seconds=1.0, rate=50.0).load("run0"), name=f"r{k}")
                                  for k in range(42)]))
    print_survey(many, "tank")
    lines = capsys.readouterr().out.splitlines()
    assert "... and 2 more recordings." in lines
    assert lines[-1].startswith("Next: ")
    print_survey(GOOD, "tank")
    assert "Usable" in capsys.readouterr().out.splitlines()[-2]
