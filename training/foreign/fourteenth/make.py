"""Synthetic campaigns of robot arms with known answers: `python make.py FOLDER` writes 30 campaigns and answers.json.

FOLDER must not be there yet. Nothing of nnhydro is used.
"""

import json
import sys
from pathlib import Path

import healthy
import hidden_drives
import hidden_joints
import hidden_swings
import hidden_wakes
import hidden_water
import numpy as np
import unlisted
from checks import check_physics
from record import write_campaign

CAMPAIGNS = (
    healthy.plain_tank_arm, healthy.geared_paddle, healthy.three_links, healthy.belt_driven, healthy.steady_tows,
    healthy.industrial_joints, healthy.oscillating_carriage, healthy.three_recordings,
    hidden_joints.sticking_seal, hidden_wakes.big_cylinder, hidden_wakes.paddle_from_rest, hidden_water.ball_at_tip,
    hidden_joints.hose_and_encoder, hidden_drives.harmonic_drive, hidden_drives.elastic_joint, hidden_drives.worn_gear,
    hidden_water.paddle_in_oil, hidden_water.tank_with_pump, hidden_water.waves_overhead, hidden_joints.propeller_shaft,
    hidden_wakes.shedding_cylinder, hidden_joints.drift_and_rotor, hidden_joints.filtering_amplifier, hidden_swings.steel_pendulum,
    hidden_swings.rolling_hull, hidden_wakes.folded_arm, hidden_drives.swaying_strut,
    unlisted.stout_link, unlisted.eccentric_seal, unlisted.pulled_sensor)
ORDER = 14  # seeds the order


def main(target: Path) -> None:
    """Write all campaigns in an order that tells nothing, and the answers."""
    check_physics(np.random.default_rng(0))
    target.mkdir(parents=True)
    answers = {}
    for place, k in enumerate(np.random.default_rng(ORDER).permutation(len(CAMPAIGNS))):
        answer = answers[f"case_{place:03d}"] = write_campaign(CAMPAIGNS[k](), target, place)
        hidden = [tuple(entry.values())[:4] for entry in answer["hidden"]]
        print(f"case_{place:03d}", answer["title"], hidden, "left after refit:", answer["left_after_refit"], flush=True)
    (target / "answers.json").write_text(json.dumps(answers, indent=1))


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    main(folder) if not folder.exists() else sys.exit(f"{folder}: is there already: name a folder that is not")
