"""Machines that other people built, with answers that are known: the right names, no wrong one, and the errors of a free fit.

The recordings are not part of this repository (training/real_rigs/README.md says where each is published); without them all is skipped.
"""

import json
from functools import cache
from pathlib import Path

import pytest

from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.recordings.campaign import Campaign, open_campaign

pytestmark = pytest.mark.slow
REAL = Path(__file__).parents[2].parent / "shared" / "data"
MANY = 8  # recordings
RIGS = ("dfki_pendubot", "multiarm_single", "rm2_tare_torque", "kvlcc2_15kn", "dfki_double_pendulum_a0", "dfki_double_pendulum_c0")


def known(name):
    """What is known of a rig, and where its campaign lies."""
    answers = REAL / "rigs" / "answers.json"
    if not answers.is_file():
        pytest.skip(f"{answers}: the recordings of real rigs are not here")
    answer = json.loads(answers.read_text())[name]
    return answer, REAL / "rigs" / answer.get("path", name)


@cache
def diagnosed(name):
    """What is diagnosed of a rig; of one with many recordings, of every second."""
    answer, folder = known(name)
    whole = open_campaign(folder)
    if len(whole.names) > MANY:
        whole = Campaign.of(whole.arm, [whole.load(name) for name in whole.names[::2]], whole.steady)
    return diagnose(whole, answer["baseline"])


def alike(finding):
    return {finding.effect, *finding.equivalence_set}


@pytest.mark.parametrize("name", RIGS)
def test_what_is_known_of_a_real_rig_is_named_and_nothing_else(name):
    answer, _ = known(name)
    findings = list(diagnosed(name).findings)
    for effects, joint, span in answer["must"]:
        right = [f for f in findings if alike(f) & set(effects) and f.law.joint in (joint, 0)]
        assert right, f"{effects} at joint {joint} is not named, but {[(f.effect, f.joint) for f in findings]}"
        if span is not None and right[0].effect in effects:
            low, high = next(iter(right[0].parameters.values())).ci95
            assert max(low, span[0]) <= min(high, span[1]), f"{effects}: {low} to {high}, known {span}"  # both are intervals
        findings = [f for f in findings if f not in right]
    assert all(alike(f) & set(answer["may"]) for f in findings), [(f.effect, f.joint, f.statement) for f in findings]


@pytest.mark.parametrize("name", RIGS)
def test_the_corrected_model_of_a_real_rig_errs_no_more_than_its_card_says(name):
    answer, _ = known(name)
    told = diagnosed(name)
    assert told.heldout.after <= told.heldout.before
    if answer["error"] is not None:
        assert told.heldout.after < 1.1 * answer["error"]
