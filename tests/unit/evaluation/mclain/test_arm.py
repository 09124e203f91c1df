"""McLain & Rock's arm, their models and their constants."""

import pytest
import torch
from mclain import golden

from nnhydro.evaluation.mclain.arm import VALIDATION, comparison_models, fitted_constants, pooled_error, slew, truth
from nnhydro.physics.motion import tensor

ERRORS = golden("errors")
FLOWS = [slew(*motion) for motion in VALIDATION]
EXACT = [truth().torque(flow)[:, 0] for flow in FLOWS]


@pytest.mark.parametrize(("name", "key"), [("Levesque & Richard", "levesque_richard_Cd1.1_Cm0"), ("textbook", "standard_Cd1.2_Cm1")])
def test_the_errors_of_the_papers_two_rivals_are_the_golden_ones(name, key):
    model = comparison_models()[name]
    ours = [model.torque(flow) for flow in FLOWS]
    assert pooled_error(EXACT, ours) == pytest.approx(ERRORS["pooled"][key], abs=1e-9)
    for document, tau, modelled in zip(ERRORS["per_slew"], EXACT, ours, strict=True):
        assert pooled_error([tau], [modelled]) == pytest.approx(document[key], abs=1e-9)
    exact = [-tensor(s["T_hyd_continuum"]) for s in golden("slews")["slews"]]
    continuum = pooled_error(exact, [model_torque(model, flow) for flow in FLOWS])
    assert continuum == pytest.approx(ERRORS["pooled_continuum"][key], abs=1e-5)


def model_torque(model, flow):
    """Constants in the continuum."""
    from nnhydro.evaluation.mclain.arm import constant_columns

    return constant_columns(flow, 1000) @ torch.tensor([model.C_D, model.C_M], dtype=torch.float64)


def test_fitted_constants_are_the_golden_ones():
    best, wanted = fitted_constants(list(zip(FLOWS, EXACT, strict=True))), ERRORS["best_constant_coefficients_lstsq"]
    assert pytest.approx(wanted["Cd"], abs=1e-9) == best.C_D
    assert pytest.approx(wanted["Cm"], abs=1e-9) == best.C_M
    assert pooled_error(EXACT, [best.torque(flow) for flow in FLOWS]) == pytest.approx(wanted["pooled_error"], abs=1e-9)
