"""Constants found in tanks whose water was computed by other code: near the ones on the data sets' cards."""

import json
from pathlib import Path

import pytest

from nnhydro.fitting.identify import identify
from nnhydro.recordings.campaign import open_campaign

DATASETS = Path(__file__).parents[2] / "datasets"


def values(name):
    found = identify(open_campaign(DATASETS / name))
    return found, {key: e["value"] for key, e in found.fit["parameters"].items()}


@pytest.mark.slow
def test_the_slewing_cylinder_has_the_constants_of_its_card():
    _, parameters = values("mclain_tank")
    assert parameters["normal_drag.C_D[1]"] == pytest.approx(0.82, abs=0.02)
    assert parameters["added_mass.C_M[1]"] == pytest.approx(0.49, abs=0.03)


@pytest.mark.slow
def test_the_towed_arm_has_the_constants_of_its_card_and_its_true_masses():
    model, parameters = values("rivera_tank")
    for j, C_D, C_M in ((1, 1.10, 0.19), (2, 1.21, 0.27)):
        assert parameters[f"normal_drag.C_D[{j}]"] == pytest.approx(C_D, abs=0.1)
        assert parameters[f"added_mass.C_M[{j}]"] == pytest.approx(C_M, abs=0.2)
    truth = json.loads((DATASETS / "rivera_tank" / "answers" / "truth.json").read_text())["links"]
    for j, (link, true) in enumerate(zip(model.arm.links, truth, strict=True), start=1):  # weighed to 2 %
        assert parameters[f"rigid_body.mass[{j}]"] == pytest.approx(link.mass_kg, rel=0.06)
        assert parameters[f"rigid_body.mass[{j}]"] == pytest.approx(true["mass"], rel=0.04)
