"""What every hypothesis of the catalogue must do, whoever wrote it; none is named here but in the list of the contract."""

import inspect
import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from rigs import arm, assert_close, at_rest, hub_at_rest, mirrored_about_X, run, states

from nnhydro.effects.catalogue import candidates, catalogue, instrument_of
from nnhydro.effects.effect import InstrumentEffect, LoadEffect
from nnhydro.effects.quantity import intervals
from nnhydro.effects.sensor_view import SensorView
from nnhydro.errors import ModelError
from nnhydro.models.baselines import baseline
from nnhydro.models.storage import load_model, save_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import term_kinds, term_of
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.filtering.preprocessing import Preparation

FAMILIES = {
    "wake": "wake_development flow_memory wake_reentry history_force vortex_shedding",
    "drag_law": "reynolds_drag axial_drag tip_drag drag_form", "interference": "link_interference wall_proximity",
    "water": "ambient_current wave_orbital", "inertia": "added_mass rotor_inertia payload_mass munk_moment",
    "dry_friction": "coulomb_friction stribeck_friction load_friction", "viscous": "viscous_friction",
    "restoring": "buoyancy_tilt umbilical_stiffness",
    "transmission": "joint_elasticity oscillating_mass flexible_mount backlash torque_ripple",
    "torque_sensor": "torque_bias torque_gain torque_drift torque_crosstalk torque_saturation force_crosstalk", "timing": "sensor_timing",
    "angle_sensor": "encoder_offset",
}
EFFECTS = dict(catalogue())
PEAK = (5.0, 2.0, 1.0)  # N m
IDS = pytest.mark.parametrize("id_", EFFECTS)
LINKS = pytest.mark.parametrize("links", [1, 2, 3])
INSTRUMENTS = pytest.mark.parametrize("id_", [i for i, cls in EFFECTS.items() if issubclass(cls, InstrumentEffect)])


def found(id_, a):
    return candidates(EFFECTS[id_], a, PEAK[:a.n_links])


def view(a, motion, water=True):
    loads = baseline("constant" if water else "rigid").start(a)
    place = tensor(np.linspace(-1, 1, len(motion)))
    return SensorView.of(loads, Flow(a, motion), place)


def columns(hypothesis, seen):
    """The columns of a hypothesis; `seen` serves all those of one motion, and what they have in common is made once."""
    return hypothesis.columns(seen if isinstance(hypothesis, InstrumentEffect) else seen.flow)


def valued(hypothesis, size=1.0):
    """The effect with every linear value at `size` times the start, or times a hundredth of the bound where it starts at 0."""
    starts = [v or 0.01 * high for v, (_, high) in zip(hypothesis.linear_values().tolist(), hypothesis.linear_bounds(), strict=True)]
    return hypothesis.with_linear(size * torch.tensor(starts, dtype=torch.float64))


def test_the_catalogue_holds_the_contracts_names_in_their_families():
    named = {id_: family for family, ids in FAMILIES.items() for id_ in ids.split()}
    assert {id_: EFFECTS[id_].family for id_ in named} == named
    ours = {cls.family for cls in EFFECTS.values() if cls.__module__.startswith("nnhydro.")}
    assert ours == set(FAMILIES), "a new effect joins a family; a new family is written down here first"


@pytest.mark.parametrize("id_", sorted(set(EFFECTS) & set(term_kinds())))
def test_an_effect_and_the_load_of_its_name_have_the_same_parameters(id_):
    of_load, of_effect = ({field.name for field in cls.parameters()} for cls in (term_kinds()[id_], EFFECTS[id_]))
    assert of_load <= of_effect


@IDS
def test_a_file_is_one_hypothesis_named_as_its_id_and_the_class_is_final(id_):
    cls = EFFECTS[id_]
    module = inspect.getmodule(cls)
    assert module.__name__ == f"nnhydro.effects.hypotheses.{id_}"
    assert len(inspect.getsource(module).splitlines()) < 150
    assert getattr(cls, "__final__", False)


@IDS
def test_look_alikes_are_in_the_catalogue(id_):
    rivals = EFFECTS[id_].signature.mistaken_for
    assert rivals
    assert id_ not in rivals
    assert set(rivals) <= set(EFFECTS)


@IDS
@LINKS
@pytest.mark.parametrize("make", [states, run])
def test_columns_have_the_right_shape_and_are_finite(id_, links, make):
    a, motion = arm(links), make(links)
    seen = view(a, motion)
    for hypothesis in found(id_, a):
        X = columns(hypothesis, seen)
        assert X.shape == (len(motion), links, len(hypothesis.linear_values()))
        assert X.dtype == torch.float64
        assert X.isfinite().all()


@IDS
def test_it_can_be_seen_in_some_motion_of_a_two_link_arm(id_):
    a = arm(2)
    seen = view(a, run(2, rows=200))
    assert any(columns(hypothesis, seen).any() for hypothesis in found(id_, a))


@IDS
@pytest.mark.parametrize("rows", [0, 1, 3])
def test_short_stretches_are_no_trouble(id_, rows):
    a, motion = arm(2), run(2)
    short = replace(motion, **{name: getattr(motion, name)[:rows] for name in ("t", "q", "qd", "qdd", "u0", "du0")})
    hypothesis = found(id_, a)[0]
    assert columns(hypothesis, view(a, short)).shape[:2] == (rows, 2)
    if isinstance(hypothesis, InstrumentEffect):
        assert hypothesis.apply(view(a, short)).shape == (rows, 2)


@IDS
def test_candidates_make_sense_for_the_arm(id_):
    cls = EFFECTS[id_]
    assert len(found(id_, arm(1))) > 0 or cls.fewest_links > 1
    if cls.needs_water:
        assert found(id_, arm(2, density=0.0)) == ()
    joints = {hypothesis.joint for hypothesis in found(id_, arm(3))}
    assert joints == ({0} if cls.acts == "arm" else {1, 2, 3})
    laws = [law for law in (found(id_, arm(2))[0], *found(id_, arm(2))[0].narrower()) if law.acts_on(arm(3))]
    points = [int(np.prod([len(grid) for name, grid in cls.grids().items() if getattr(law, name)])) for law in laws]
    assert len(found(id_, arm(3))) == len(joints) * sum(points)


@IDS
def test_a_joint_that_is_not_there_is_refused(id_):
    with pytest.raises(ModelError, match=id_):
        EFFECTS[id_].at_start(arm(2), joint=1 if EFFECTS[id_].acts == "arm" else 0)


@IDS
def test_what_the_card_says_of_rest_is_true(id_):
    a = arm(2)
    still = view(a, replace(at_rest(2), steady=False))
    X = max(float(columns(hypothesis, still).abs().max()) for hypothesis in found(id_, a))
    assert (X == 0.0) == EFFECTS[id_].signature.zero_at_rest, f"the card says zero_at_rest={X != 0.0}, and the columns do not"


@IDS
def test_what_the_card_says_of_the_mirror_is_true(id_):
    a, motion = arm(2), run(2, rows=150)
    parity = EFFECTS[id_].signature.parity
    sign = {"odd": -1, "even": 1, "mixed": 0}[parity]
    unlike, in_the_mirror, as_it_is = 0.0, view(a, mirrored_about_X(motion)), view(a, motion)
    for hypothesis in found(id_, a)[:6]:
        there, here = columns(hypothesis, in_the_mirror), columns(hypothesis, as_it_is)
        if sign:
            off = float((there - sign * here).abs().max())
            assert off <= 1e-6 * max(float(here.abs().max()), 1e-9), f"the card says parity={parity!r}, and the columns do not"
        unlike += min(float((there + here).abs().max()), float((there - here).abs().max()))
    assert sign or unlike > 0


@IDS
def test_friction_never_gives_energy(id_):
    cls = EFFECTS[id_]
    assert cls.dissipates or cls.family not in ("dry_friction", "viscous")
    if cls.dissipates:
        a, motion = arm(2), hub_at_rest(states(2))
        seen = view(a, motion)
        for hypothesis in found(id_, a):
            X = columns(hypothesis, seen)
            assert ((X * motion.qd[..., None]).sum(1) >= -1e-12).all()
            assert all(low >= 0 for low, _ in hypothesis.linear_bounds())


@IDS
def test_it_is_stored_and_found_again(id_):
    for hypothesis in found(id_, arm(2))[:3]:
        document = json.loads(json.dumps(valued(hypothesis).document()))
        parse = instrument_of if isinstance(hypothesis, InstrumentEffect) else term_of
        assert parse(document) == valued(hypothesis)
        with pytest.raises(ModelError, match=id_):
            parse({**document, "options": {**document["options"], "no_such_thing": 1}})


@pytest.mark.parametrize("id_", [i for i, cls in EFFECTS.items() if issubclass(cls, LoadEffect)])
def test_a_model_file_holds_a_load_that_was_found(id_, tmp_path):
    a, motion = arm(2), run(2)
    loads = baseline("constant").start(a).plus(f"effect {id_}", valued(found(id_, a)[-1], 0.1))
    model = StripTheory(a, Preparation(None), {}, "constant", loads)
    again = load_model(save_model(model, tmp_path / "m"))
    assert torch.equal(again.torque(motion), model.torque(motion))
    assert again.torque(motion).isfinite().all()


@IDS
def test_the_finding_is_a_sentence_with_numbers_and_units(id_):
    for hypothesis in {hypothesis.joint: hypothesis for hypothesis in found(id_, arm(2))}.values():
        said = valued(hypothesis)
        quantities = said.quantities()
        assert quantities
        spread = intervals(lambda v, s=said: s.with_linear(v).quantities(), said.linear_values(),
                           torch.diag(1e-4 * said.linear_values() ** 2))
        assert set(spread) == set(quantities)
        text = said.statement(spread)
        assert text.endswith(".")
        assert any(c.isdigit() for c in text)
        assert text[0].isupper()
        assert f"oint {hypothesis.joint}" in text or f"ink {hypothesis.joint}" in text or hypothesis.joint == 0
        units = {q.unit for q in quantities.values()} - {"1"}
        assert not units or any(unit in text for unit in units)
        assert said.statement() != ""


@INSTRUMENTS
@LINKS
def test_the_exact_reading_is_the_columns_for_a_small_effect_and_the_torque_for_none(id_, links):
    a = arm(links)
    seen = view(a, run(links, rows=600))
    for hypothesis in found(id_, a)[:8]:
        none = hypothesis.with_linear(torch.zeros_like(hypothesis.linear_values()))
        assert_close(none.apply(seen), seen.tau)
        X = hypothesis.columns(seen)
        for p in range(X.shape[-1]):
            size = 1e-8 * float(seen.tau.abs().max()) / max(float(X[..., p].abs().max()), 1e-9)
            small = hypothesis.with_linear(torch.eye(X.shape[-1], dtype=torch.float64)[p] * size)
            change = small.apply(seen) - seen.tau
            inner = slice(20, -20)  # a delay holds the ends
            wrong = float((change - small.change(seen))[inner].norm())
            assert wrong <= 0.03 * float(small.change(seen)[inner].norm())


@INSTRUMENTS
def test_an_instrument_effect_of_a_steady_table_is_finite(id_):
    a = arm(2)
    for hypothesis in found(id_, a)[:4]:
        assert valued(hypothesis, 0.01).apply(view(a, states(2))).isfinite().all()


def test_the_rigs_of_these_tests_are_what_they_say():
    m = run(2)
    assert isinstance(m, Motion)
    assert not m.steady
    assert states(2).steady


@IDS
def test_a_finding_is_said_in_sentences_that_are_read_once(id_):
    effect_ = valued(found(id_, arm(2))[0])
    text = effect_.sentence(dict.fromkeys([*effect_.quantities(), *effect_.linear_names()], "0.5"))
    assert text.endswith(".")
    for sentence in text.removesuffix(".").replace(": ", ". ").split(". "):
        assert len(sentence.split()) <= 25, sentence


@LINKS
@pytest.mark.parametrize("id_", [i for i, cls in EFFECTS.items() if issubclass(cls, InstrumentEffect) and cls.additive])
def test_an_additive_sensor_error_changes_each_part_of_the_torque_as_if_it_were_alone(id_, links):
    a = arm(links)
    loads, motion = baseline("constant").start(a), run(links)
    alone = [SensorView.of(Loads({name: term}), Flow(a, motion)) for name, term in loads.terms.items()]
    for hypothesis in found(id_, a):
        effect, whole = valued(hypothesis, 0.1), SensorView.of(loads, Flow(a, motion))
        parts = sum(effect.apply(part) - part.tau for part in alone)
        assert_close(effect.apply(whole) - whole.tau, parts, rtol=1e-9, atol=1e-9)
