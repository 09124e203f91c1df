"""Motions on a base that turns and moves, and an arm with every load."""

from dataclasses import replace

import torch

from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.axial_added_mass import AxialAddedMass
from nnhydro.physics.loads.axial_drag import AxialDrag
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.loads.water_pressure import WaterPressure
from nnhydro.physics.motion import Base


def wave(t, w, a):
    """A smooth motion from rest with its two derivatives, each (n,)."""
    return a * (1 - torch.cos(w * t)), a * w * torch.sin(w * t), a * w**2 * torch.cos(w * t)


def on_base(motion, yaw=0.0, x=0.0):
    (_, vx, ax), turn = wave(motion.t, 1.7, x), wave(motion.t, 1.3, yaw)
    return replace(motion, base=Base(vx, ax, *turn))


def everything(a):
    """Rigid body and every load of the water on `a`."""
    n = a.n_links
    return Loads({"rigid_body": RigidBody.of_arm(a), "drag": NormalDrag((1.1,) * n), "added": AddedMass((0.9,) * n),
                  "axial": AxialDrag((0.02,) * n), "axial_added": AxialAddedMass((0.1,) * n), "pressure": WaterPressure()})
