"""The score of concealed campaigns on the screen."""

from dataclasses import replace

from answers import ANSWER, HEALTHY, VERDICT, finding, of, said

from nnhydro.blind_tests.summary import summary
from nnhydro.cli.terminal.score import print_score


def shown(capsys, verdicts, missing=()):
    print_score(summary(verdicts, missing), "suite")
    return capsys.readouterr().out


def test_shares_errors_and_names_are_those_of_the_score(capsys):
    right, wrong = of(ANSWER, said(finding("umbilical_stiffness"))), of(ANSWER, said(finding("torque_bias", confidence=0.95)))
    text = shown(capsys, [replace(right, error_before=0.2, error_after=0.05), wrong], ["campaign_007"])
    assert "suite: 2 diagnoses" in text
    line = next(line for line in text.splitlines() if "one effect, strong" in line)
    assert line.count("50 %") == 3, "right, exact, wrong claim"
    assert "0.2 before, 0.05 after" in text
    assert "umbilical_stiffness (1), torque_bias (1)" in text
    assert "Without a diagnosis, not scored: campaign_007" in text
    assert text.splitlines()[-1] == "2 diagnoses scored; 2 claims made with confidence 0.9 or more, 50 % of them right."


def test_what_is_not_known_is_not_printed_as_a_number(capsys):
    text = shown(capsys, [of(HEALTHY, said(detected=False))])
    assert "None" not in text
    assert "Unseen motions" not in text
    assert text.splitlines()[-1] == "1 diagnoses scored; 0 claims made with confidence 0.9 or more."


def test_the_truths_own_error_is_said_beside_the_models(capsys):
    text = shown(capsys, [replace(VERDICT, error_before=0.10, error_after=0.04, error_true=0.02)])
    assert "the true model has an error of 0.02" in text
    assert "reach 75 % (median of the 1 of 1 campaigns with an improvement), 75 % in total" in text
