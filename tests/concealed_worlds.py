"""Concealed worlds under control: arms that hide one effect, motions, and controllers."""

from dataclasses import replace

import numpy as np

from nnhydro.blind_tests.truth import registry
from nnhydro.blind_tests.truth.arms import document
from nnhydro.blind_tests.truth.campaign import MORNING, World
from nnhydro.blind_tests.truth.world import TrueArm, TrueLink, TrueRun
from nnhydro.dynamics.joint_model import joint_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.recordings.arm import parse_arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.simulation.controller import Controller
from nnhydro.simulation.motions.motion_kind import Setting, motion_of
from nnhydro.simulation.recipe.concealed_truth import ConcealedTruth
from nnhydro.simulation.recipe.recipe import parse_recipe
from nnhydro.simulation.torque_law import Inside

ARM = TrueArm((TrueLink(0.55, 0.07, 1.1, 0.27, 0.026, 1.1, 0.8), TrueLink(0.45, 0.06, 1.4, 0.22, 0.024, 0.9, 0.9)))
SLEW = {"kind": "slew", "name": "m", "q_rad": [[-0.7, 0.8], [0.6, -0.6]], "duration_s": 0.5, "rest_s": 0.05,
        "carriage": {"u0_m_s": 0.3, "start_s": 0.05, "ramp_s": 0.2}}
STILL = {**SLEW, "carriage": {"u0_m_s": 0.0}}
GAINS = {"kp": 100.0, "kd": 20.0}
RATE, QUICK = 200.0, 100.0  # Hz
SMALL = {"effect": "link_interference", "links": 2, "size": "small", "seed": 3}


def world(name, share=0.5, seed=0, arm=ARM):
    """A world that hides `name` at the geometric `share` between the sizes that physics allows; "" hides nothing."""
    if name == "added_mass":
        arm = TrueArm(tuple(TrueLink(**{**vars(link), "C_M": 0.0}) for link in arm.links), arm.rho, arm.nu, arm.belt)
    hidden = []
    if name:
        draft = registry.makers()[name](np.random.default_rng(seed), arm)
        hidden = [(draft.make(draft.low**(1 - share) * draft.high**share if draft.low > 0 else draft.low), 0.0)]
    return World(arm, document(arm, 0.01), 0.01, tuple(hidden), None, None, np.zeros(2), None)


def truth(made, seed=5):
    """The world as the truth of a recipe."""
    return ConcealedTruth(made, parse_arm(made.stated, "arm"), seed)


def reference(motion=SLEW, of=ARM):
    """The motion as a function of time."""
    return motion_of(motion, "recipe").reference(Setting(parse_arm(document(of, 0.01), "arm"), np.random.default_rng(0), None))


def law(of, inside=None):
    """Computed torque, with the textbook inside or another model."""
    made = Controller(kind="computed_torque", model="textbook", **GAINS).torque_law(of.arm, RATE)
    return made if inside is None else replace(made, inside=Inside(joint_model(inside)))


def knows_all_but_what_is_hidden(of):
    """The strips of nnhydro with the true masses and coefficients."""
    links = of.world.arm.links
    terms = {"rigid_body": RigidBody.of_arm(of.arm), "drag": NormalDrag(tuple(k.C_D for k in links)),
             "added_mass": AddedMass(tuple(k.C_M for k in links))}
    return StripTheory(of.arm, Preparation(None), {}, "exact", Loads(terms))


def whole_run(name, state, rate, seed, start=MORNING):
    """A run whose motion is known at every instant."""
    return TrueRun(name, np.arange(len(state.u0)) / rate, *state, start, seed)


def recipe(folder=None, **keys):
    """A recipe that hides an effect in a small arm."""
    hidden = {"concealed": SMALL | keys.pop("concealed", {})}
    return parse_recipe({"truth": hidden, "motions": [dict(STILL)], "sample_rate_hz": 100, "substeps": 2, **keys}, "tank.yaml", folder)
