"""Which tiers are opened, on recordings held out of the fit."""

import pytest
import torch

from nnhydro.features.strip_law.law import REMEMBERED, SURROUNDED
from nnhydro.fitting.linear.normal_equations import CLOSED
from nnhydro.fitting.network.tier_choice import choice_of_each, chosen_weights


def test_a_tier_is_opened_only_where_held_out_recordings_ask_for_it():
    def left(weights):
        gain = {REMEMBERED: 0.5, SURROUNDED: 0.99}  # of the error, at the right weight of 1e-2
        total = 1.0
        for tier, value in gain.items():
            if weights[tier] < CLOSED:
                total *= value * (1 + 0.01 * abs(torch.tensor(weights[tier] / 1e-2).log10().item()))
        return total

    weights = chosen_weights(lambda several: [left(ratios) for ratios in several], (REMEMBERED, SURROUNDED), SURROUNDED + 1)
    assert weights[REMEMBERED] == pytest.approx(1e-2)
    assert weights[SURROUNDED] == CLOSED, "one per cent is not worth it"


def test_each_member_chooses_on_recordings_of_its_own_draw_and_all_agree_where_all_recordings_do():
    def losses(several, spread):
        gains = [[1.0, spread, 2 - spread] if weights[REMEMBERED] < CLOSED else [1.0, 1.0, 1.0] for weights in several]
        return torch.tensor(gains)[:, None, :, None].double()

    agreed = choice_of_each(lambda several: losses(several, 1.0), {REMEMBERED}, SURROUNDED, 8)
    assert {weights[REMEMBERED] for weights in agreed} == {CLOSED}
    torn = choice_of_each(lambda several: losses(several, 0.5), {REMEMBERED}, SURROUNDED, 8)
    assert len({weights[REMEMBERED] < CLOSED for weights in torn}) == 2
