"""What a campaign can reveal: plans, sizes, planted effects of the stated size, and the motions that are drawn."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from problems import rig

from nnhydro.diagnosis.calibration.injection import inject
from nnhydro.diagnosis.calibration.planned_campaign import simulate_plan
from nnhydro.diagnosis.calibration.power import _typical, power, strength_needed
from nnhydro.diagnosis.constants import FORM, RELEVANT
from nnhydro.diagnosis.diagnose import search_design
from nnhydro.diagnosis.experiment.motions import draw, neighbours
from nnhydro.effects.catalogue import catalogue

KEPT = ("coulomb_friction", "viscous_friction", "torque_bias", "umbilical_stiffness", "payload_mass", "added_mass", "torque_gain",
        "vortex_shedding")
WITHOUT = [name for name in catalogue() if name not in KEPT]
PLAN = """name: small
arm:
  fluid: {density_kg_m3: 1000.0}
  links:
    - {length_m: 0.55, diameter_m: 0.07, mass_kg: 1.0, com_m: 0.27, inertia_kg_m2: 0.026}
    - {length_m: 0.45, diameter_m: 0.06, mass_kg: 1.4, com_m: 0.22, inertia_kg_m2: 0.024}
terms: {normal_drag: {C_D: 1.1}, added_mass: {C_M: 0.8}%s}
motions:
  - {kind: fourier, name: f1, q_rad: [0.3, 0.5], duration_s: 8, reach_rad: 0.9, rate_rad_s: 2.0}
  - {kind: fourier, name: f2, q_rad: [0.3, 0.5], duration_s: 8, reach_rad: 0.9, rate_rad_s: 2.0}
  - {kind: fourier, name: f3, q_rad: [0.0, -0.5], duration_s: 8, reach_rad: 0.9, rate_rad_s: 2.0}
  - {kind: fourier, name: f4, q_rad: [0.0, 1.0], duration_s: 8, reach_rad: 0.9, rate_rad_s: 1.0}
  - {kind: slew, name: s1, q_rad: [[0, 0], [1.2, 0.6], [0, 0]], duration_s: 2.0, pause_s: 0.5}
  - {kind: slew, name: s2, q_rad: [[0.5, 0], [-1.2, 1.0], [0, 0]], duration_s: 2.0, pause_s: 0.5}
  - {kind: tow, name: t1, q_rad: [0.2, 0.4], hold_s: 4, carriage: {u0_m_s: 0.6}}
sensors: {torque_noise_share: %s, encoder_counts_per_rev: 65536}
"""


def plan(folder, noise="0.01", more=""):
    path = folder / "plan.yaml"
    path.write_text(PLAN % (more, noise))
    return path


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """The small plan as a campaign, and what it can reveal of a few effects."""
    whole, _ = simulate_plan(plan(tmp_path_factory.mktemp("plan")))
    return whole, power(whole, without=WITHOUT)


def row(found, effect, joint=0, parameter=None):
    return next(r for r in found.rows if r.hypothesis.key == (effect, joint) and parameter in (None, r.parameter))


@pytest.mark.parametrize("width", [1, 3])
def test_four_campaigns_of_five_gain_more_than_the_threshold_at_the_strength_needed(width):
    rng, threshold, occam = np.random.default_rng(0), 9.0, 6.0
    strength = strength_needed(threshold, occam, width)
    z = rng.standard_normal((40000, width))
    z[:, 0] += strength
    assert ((0.5 * (z**2).sum(axis=1) - occam) > threshold).mean() == pytest.approx(0.8, abs=0.03)


def test_the_dearer_an_effect_the_stronger_it_must_be():
    plain = strength_needed(10.0, 5.0, 1)
    assert strength_needed(12.0, 5.0, 1) > plain
    assert strength_needed(10.0, 7.0, 1) > plain
    assert strength_needed(10.0, 5.0, 2) < plain, "chance adds half a nat a value"


@pytest.mark.slow
def test_what_the_baseline_fits_cannot_be_revealed_and_says_so(small):
    mine = row(small[1], "added_mass", parameter="C_M[1]")
    assert mine.size is None
    assert mine.strength is None
    assert mine.visible < 1e-3


def test_a_size_that_can_be_revealed_has_a_strength_and_lies_within_bounds(small):
    assert {r.size is None for r in small[1].rows} == {True, False}
    for r in small[1].rows:
        assert (r.size is None) == (r.strength is None)
        assert 0 <= r.visible <= 1
        assert r.size is None or r.size > 0


def test_an_effect_that_the_unknown_can_hold_must_be_stronger_than_one_that_it_cannot(small):
    """A friction is a function of one rate, which the unknown takes up; a payload is a change of the arm's own parameters."""
    assert row(small[1], "viscous_friction", 2).strength > 1.3 * row(small[1], "torque_gain", 2).strength


def test_a_constant_and_a_hose_are_most_alike(small):
    mine = row(small[1], "torque_bias", 1)
    assert (mine.rival, mine.likeness) == ("umbilical_stiffness", pytest.approx(1.0, abs=0.01))
    waves = row(small[1], "vortex_shedding")
    assert (waves.rival, waves.likeness) == (None, 0.0), "nobody knows its phase"
    assert waves.size is not None


def test_a_weighed_link_hides_more_of_a_payload_the_less_it_is_known(small, tmp_path):
    rough = tmp_path / "rough.yaml"
    rough.write_text((PLAN % ("", "0.01")).replace("0.024}", "0.024, known_to: 0.2}"))
    loose = power(simulate_plan(rough)[0], without=[name for name in catalogue() if name != "payload_mass"])
    assert row(loose, "payload_mass").visible < row(small[1], "payload_mass").visible


@pytest.mark.slow
def test_more_noise_asks_for_a_larger_size(small, tmp_path):
    loud = power(simulate_plan(plan(tmp_path, "0.03"))[0], without=WITHOUT)
    for effect, joint in (("torque_bias", 1), ("torque_gain", 2), ("coulomb_friction", 2)):
        assert 1.4 < row(loud, effect, joint).size / row(small[1], effect, joint).size < 9, "three times the noise, nine times its energy"


def test_no_size_is_stated_that_moves_the_torque_too_little_to_be_claimed(small):
    """A friction of joint 2 would show from less on: its size is that at which it makes FORM of the energy of the noise."""
    found, mine = small[1], row(small[1], "coulomb_friction", 2)
    noise = np.sqrt(found.noise.v.sum(axis=0) / found.design.duration) / found.design.scale
    assert np.sqrt(FORM) * noise.min() < mine.size / found.design.scale[1] < RELEVANT
    assert mine.strength > 10


def test_the_document_tells_noise_recordings_and_a_row_a_parameter(small):
    told = small[1].document()
    assert (told["schema"], told["baseline"], told["recordings"], told["chance"]) == ("nnhydro/power/1", "constant", 7, 0.8)
    assert len(told["effects"]) == len(small[1].rows)
    assert 0.005 < told["noise_Nm"][1] < told["noise_Nm"][0] < 0.05
    assert {r["effect"] for r in told["effects"]} == set(KEPT)


def shaped(size, width=1):
    return 0, SimpleNamespace(size=size, hypothesis=SimpleNamespace(width=width))


@pytest.mark.parametrize(("sizes", "middle"), [([3.0], 3.0), ([3.0, 1.0, 2.0], 2.0), ([4.0, 1.0, 3.0, 2.0], 2.0), ([None, 1.0, None], 1.0),
                                               ([None, 2.0, 1.0, None, 3.0], 2.0), ([None, None], None)])
def test_the_typical_shape_is_that_of_the_middle_size_among_those_that_are_found(sizes, middle):
    assert _typical([shaped(size) for size in sizes])[1].size == middle


def test_of_an_effect_with_several_laws_the_size_is_that_of_the_law_found_earliest():
    laws = [shaped(size, width) for size, width in ((3.0, 2), (4.0, 2), (9.0, 2), (6.0, 4), (7.0, 4), (8.0, 4))]
    told = _typical(laws)[1]
    assert (told.size, told.hypothesis.width) == (4.0, 2)
    assert _typical([shaped(None, 2), shaped(5.0, 4)])[1].size == 5.0


def planted_at(found, mine, share, seed):
    """What is claimed where the effect of the row is planted at a share of its stated size."""
    z = np.zeros(found.design.Y.shape[2])
    design = inject(found.design, found.noise, found.model, z, [(mine.hypothesis, mine.direction * mine.size * share)], seed)
    done = search_design(design, seed, WITHOUT)
    return {done.search.key(k)[0] for k in done.decided.claimed.chosen}


DRAWS, MOST = 6, 4  # 0.6 of 6, rounded up: 0.8 less 1.2 standard deviations of 6 draws


def most_of_the_draws(found, share, named):
    """Whether in MOST draws of DRAWS an effect planted at a share of its size is named, or is not; what is decided draws no more."""
    effects = (("coulomb_friction", 2, "level"), ("torque_gain", 1, "error"), ("viscous_friction", 1, "coefficient"))
    so = other = 0
    for seed in range(DRAWS // len(effects)):
        for effect, joint, parameter in effects:
            as_said = (effect in planted_at(found, row(found, effect, joint, parameter), share, seed)) == named
            so, other = so + as_said, other + (not as_said)
            if so >= MOST or other > DRAWS - MOST:
                return so >= MOST
    raise AssertionError("all draws decide")


@pytest.mark.slow
def test_effects_of_the_stated_size_are_found_and_of_a_third_of_it_are_not(small):
    assert most_of_the_draws(small[1], 1.0, True)
    assert most_of_the_draws(small[1], 1 / 3, False)


def test_every_motion_drawn_or_varied_stays_within_the_limits_of_the_rig(small):
    limits, rng = rig(), np.random.default_rng(1)
    drawn = draw(limits, small[0].arm, 100.0, 30, rng)
    assert len(drawn) == 30
    assert {m.document["kind"] for m in drawn} == {"slew", "fourier", "tow"}
    for motion in [*drawn, *neighbours(drawn[:5], limits, small[0].arm, 100.0, 20, rng)]:
        s = motion.state
        assert (s.q >= limits.q[:, 0] - 1e-6).all()
        assert (s.q <= limits.q[:, 1] + 1e-6).all()
        assert (np.abs(s.qd) <= limits.rate * 1.001).all()
        assert (np.abs(s.qdd) <= limits.acceleration * 1.001).all()
        assert np.abs(s.u0).max() <= 0.5 + 1e-9


def test_no_motion_is_towed_where_the_carriage_has_never_moved(small):
    drawn = draw(replace(rig(), u0=0.0), small[0].arm, 100.0, 20, np.random.default_rng(1))
    assert not any(m.state.u0.any() for m in drawn)
