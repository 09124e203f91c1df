"""The measured coefficients where literature states them: typed here from the sources, not taken from the tables that are tested."""

import pytest
import torch
from rigs import arm, run

from nnhydro.physics.coefficients import aspect_ratio, keulegan_carpenter, reynolds
from nnhydro.physics.coefficients.law import law_of
from nnhydro.physics.coefficients.parallel_distance import proximity
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.travel_added_mass import StateAddedMass
from nnhydro.physics.loads.travel_drag import StateDrag
from nnhydro.physics.motion import tensor
from nnhydro.physics.travel.state_model import bspline_loads, state_loads

PUBLISHED = [
    # Goettingen's finite cylinders, and what DNV-RP-C205 gives for the added mass of short ones (no separation)
    (aspect_ratio.drag_coefficient, (1.0, 2.0, 5.0, 10.0, 20.0, 42.0), (0.61, 0.69, 0.74, 0.82, 0.93, 0.99)),
    (aspect_ratio.added_mass_coefficient, (1.2, 2.5, 5.0, 9.0, 1e4), (0.62, 0.78, 0.90, 0.96, 1.00)),
    # a long smooth cylinder from Re = 100 through the drag crisis; a rough one, k/D = 1e-2
    (reynolds.drag_coefficient, (1e2, 2e2, 9e2, 2.3e3, 5e3, 1.5e4, 1e5, 2.2e5, 3.65e5, 5e5, 1e6, 3e6),
     (1.4, 1.27, 0.96, 0.89, 0.94, 1.14, 1.17, 1.06, 0.73, 0.31, 0.37, 0.63)),
    (lambda Re: reynolds.drag_coefficient(Re, True), (5e4, 6e4, 2e5, 8e5), (0.8, 0.8, 1.02, 1.08)),
    # API RP 2A, B.5.3.1.2.8: drag of oscillating flow over that of steady flow; inertia 2.0 up to K = 3, 1.6 and 1.2 from K = 17 C_D on
    (keulegan_carpenter.drag_ratio, (5.0, 10.0, 15.0, 20.0, 30.0, 60.0), (0.4, 0.78, 1.07, 1.25, 1.18, 1.0)),
    (lambda KC: keulegan_carpenter.drag_ratio(KC, True), (5.0, 10.0, 15.0, 20.0), (0.8, 1.3, 1.4, 1.25)),
    (keulegan_carpenter.added_mass_coefficient, (1.0, 3.0, 19.89, 40.0), (1.0, 1.0, 0.6, 0.6)),
    (lambda KC: keulegan_carpenter.added_mass_coefficient(KC, True), (3.0, 18.36, 40.0), (1.0, 0.2, 0.2)),
    # side by side: no interaction beyond 3.5 diameters (Zdravkovich)
    (proximity, (0.5, 1.0, 2.0, 3.5, 9.0), (1.0, 1.0, 0.5, 0.0, 0.0)),
]


@pytest.mark.parametrize(("law", "at", "values"), PUBLISHED)
def test_the_law_gives_what_was_measured(law, at, values):
    assert law(tensor(at)).tolist() == pytest.approx(values, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize(("at", "value"), [(4.0, 0.976), (2.999, 1.0), (11.445, 0.8)])
def test_the_inertia_of_oscillating_flow_falls_from_KC_3_on(at, value):
    assert float(keulegan_carpenter.added_mass_coefficient(tensor([at]))[0]) == pytest.approx(value, abs=0.003)


@pytest.mark.parametrize("kind", ["reynolds_smooth", "reynolds_rough"])
def test_a_law_of_the_Reynolds_number_is_one_where_the_constant_was_measured(kind):
    law, a = law_of(kind), arm(2)
    state = StateDrag.at_start(a).state(Flow(a, run(2)))
    factor, Re = law.drag(state), state.Re
    wanted = reynolds.drag_coefficient(Re, "rough" in kind) / reynolds.drag_coefficient(tensor([1e5]), "rough" in kind)
    assert torch.allclose(factor, wanted)
    assert bool((factor < 1.7).all())


def test_one_B_spline_is_enough_and_none_is_refused():
    assert len(bspline_loads(arm(2), 1).terms["bspline_drag"].linear_values()) == 1
    with pytest.raises(Exception, match="give at least 1"):
        bspline_loads(arm(2), 0)


def test_curves_of_their_own_are_read_link_by_link():
    term = state_loads(arm(2), curve_per_link=True).terms["state_added_mass"]
    assert isinstance(term, StateAddedMass)
    values = term.linear_values().clone()
    values[1::2] += 0.5  # of the second link
    changed = term.with_linear(values)
    at = tensor([3.0, 9.0])
    assert torch.allclose(changed.curve(at, 0), term.curve(at, 0))
    assert float((changed.curve(at, 1) - term.curve(at, 1)).abs().min()) > 0.1
