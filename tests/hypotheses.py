"""Hypotheses with given values, and what a sensor sees of an arm or of a torque over time."""

from dataclasses import replace

import torch
from rigs import arm

from nnhydro.effects.catalogue import catalogue
from nnhydro.effects.effect import REGISTER
from nnhydro.effects.sensor_view import SensorView
from nnhydro.models.baselines import baseline
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor

catalogue()

PLUGIN = '''
from dataclasses import dataclass
from nnhydro.effects.effect import LoadEffect, Signature, Values, at_joint, effect, parameter

@effect
@dataclass(frozen=True)
class Squeak(LoadEffect):
    id = "squeak"
    family = "dry_friction"
    name = "squeak of a dry bush"
    mechanism = "It squeaks."
    equation = "tau_j = a qd_j^3"
    source = "heard"
    signature = Signature(depends_on=("qd",), parity="odd", region="fast", excited_by="turning", mistaken_for=("viscous_friction",))
    acts = "joint"
    a: Values = parameter("N m s^3/rad^3", 0.1, (0.0, 9.0), "strength", per="arm")

    def columns(self, flow):
        return at_joint(flow.motion.qd[:, self.joint - 1:self.joint] ** 3, self.joint, flow.arm.n_links)
'''


def made(id_, a, joint=0, **values):
    options = {name: values.pop(name) for name in list(values) if not isinstance(values[name], tuple)}
    return replace(REGISTER[id_].at_start(a, joint=joint, **options), **values)


def view(a, motion, name="constant"):
    loads = baseline(name).start(a)
    return SensorView.of(loads, Flow(a, motion))


def of_time(t, tau, a=None):
    """A view of one joint at rest whose reading is tau(t)."""
    a = a or arm(1)
    still = torch.zeros(len(t), 1, dtype=torch.float64)
    flow = Flow(a, Motion(tensor(t), still, still, still, still[:, 0], still[:, 0]))
    return SensorView(flow, lambda flows: [tensor(tau)[:, None] for _ in flows])


def steady(q, qd=0.0, qdd=0.0, u0=0.0, du0=0.0):
    return Motion.at(q, qd, qdd, u0, du0)
