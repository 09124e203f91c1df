"""A drive that resonates within the motion's band is found from starts of its own: about a rigid one nothing leads there."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import planted, recording
from rigs import arm
from scipy.interpolate import CubicSpline

from nnhydro.diagnosis.case import opened
from nnhydro.diagnosis.instances import instances, settled
from nnhydro.diagnosis.naming import named, torque_peaks
from nnhydro.diagnosis.race import race_of
from nnhydro.diagnosis.starts import started
from nnhydro.diagnosis.table import Table
from nnhydro.effects.catalogue import catalogue
from nnhydro.effects.joint_elasticity import RESONANCES, JointElasticity
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign

ARM = arm(1)
NOISE = 0.003  # N m
TRIED = ("joint_elasticity", "sensor_timing", "rotor_inertia", "flow_memory", "torque_gain", "reynolds_drag", "coulomb_friction")


def inertia():
    """Of the wet link, kg m^2: its torque at a unit acceleration from rest."""
    loads = planted(ARM)
    return float(Loads(loads.terms).torque(Flow(ARM, Motion.at([[0.0]], [[0.0]], [[1.0]])))[0, 0])


def springy(stiffness, count=8):
    """A campaign in which the link moves as told and the encoder sits on the other side of a spring of `stiffness` N m/rad."""
    made, rng = [], np.random.default_rng(5)
    for k in range(count):
        r = recording(ARM, planted(ARM), f"run{k:02d}", seed=k + 1, noise=0.0, seconds=5.0)
        twist = CubicSpline(r.t, np.asarray(r.tau) / stiffness)
        made.append(replace(r, q=r.q + twist(r.t), qd=r.qd + twist(r.t, 1), qdd=r.qdd + twist(r.t, 2),
                            tau=r.tau + NOISE * rng.standard_normal(r.q.shape)))
    return Campaign.of(ARM, made)


@pytest.mark.parametrize("resonance", [6.0, 9.0])
def test_a_drive_whose_resonance_lies_in_the_band_is_found_with_its_stiffness(resonance):
    stiffness = inertia() * (2 * np.pi * resonance) ** 2
    ready = opened(springy(stiffness))
    findings = named(ready.case, ready.repeats, 0, without=[name for name in catalogue() if name not in TRIED]).findings
    assert [f.effect.id for f in findings] == ["joint_elasticity"]
    found = findings[0]
    assert (found.effect.id, found.effect.joint) == ("joint_elasticity", 1)
    assert found.confidence > 0.9
    assert found.parameters["stiffness"]["value"] == pytest.approx(stiffness, rel=0.2)  # what is told stops at 0.9 of the resonance


def test_the_starts_resonate_where_the_card_says_and_count_as_values_that_were_tried():
    ready = opened(springy(1e3, count=4))
    known = [i for i in instances(ARM, torque_peaks(ready.case.all_units)) if i.key[0] in TRIED]
    with_starts = started(ready.case, known)
    drives = [i for i in with_starts if isinstance(i.effect, JointElasticity)]
    assert len(with_starts) == len(known) + len(RESONANCES)
    assert [i.grid for i in drives] == [1 + len(RESONANCES)] * len(drives)
    assert drives[0].believed is None, "about no effect, as before"
    told = [1 / (2 * np.pi * np.sqrt(i.effect.compliance[0] * inertia())) for i in drives[1:]]
    assert told == pytest.approx(RESONANCES, rel=0.1)
    assert all(i.believed is ready.case.model for i in drives[1:])
    others = [[(i.effect, i.grid) for i in some if i.key != drives[0].key] for some in (with_starts, known)]
    assert others[0] == others[1]


def test_settled_values_that_nobody_has_fitted_do_not_tell_what_noise_is():
    ready = opened(springy(inertia() * (2 * np.pi * 6.0) ** 2, count=4))
    known = [i for i in instances(ARM, torque_peaks(ready.case.all_units)) if i.key[0] in TRIED]
    table = Table(ready.case)
    plain, with_starts = (race_of(table, some, ready.case.model, None) for some in (known, started(ready.case, known)))
    np.testing.assert_allclose(with_starts.noise, plain.noise, rtol=1e-9)
    some = started(ready.case, known)
    fitted = [settled(i, i.effect.linear_values(), ready.case.model) if i.start else i for i in some]
    assert [i.start for i in some].count(True) == len(RESONANCES)
    assert not any(i.start for i in fitted), "what has been settled about values of its own is a start no more"
    assert (race_of(table, fitted, ready.case.model, None).noise < 0.9 * plain.noise).all()
