"""Hypothesis: there is a mass at the tip that arm.yaml does not state."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.effect import ANY_SIZE, LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.rigid_body import RigidBody


@effect
@final
@dataclass(frozen=True)
class PayloadMass(LoadEffect):
    """A point mass at the end of the last link or a little beyond it, weight included."""

    id = "payload_mass"
    family = "inertia"
    name = "mass at the tip"
    mechanism = "A tool, a sensor or trapped water at the tip adds a mass that arm.yaml does not state."
    equation = "tau = m J^T (a + g),  J and a the Jacobian and the acceleration of the point at L + beyond on the last link's axis"
    source = "Rivera (1995), section 3.3 (rigid-body dynamics) with one more point mass"
    signature = Signature(
        depends_on=("q", "qd", "qdd", "u0"), parity="odd", region="strong acceleration of the tip",
        excited_by="accelerating stretched and folded, and with gravity in the plane",
        mistaken_for=("rotor_inertia", "added_mass", "buoyancy_tilt"),
    )
    acts = "arm"

    mass: Values = parameter("kg", 0.1, ANY_SIZE, "mass at the tip", per="arm")
    beyond: Values = parameter("m", 0.0, (0.0, 1.0), "how far beyond the link's end its centre lies", per="arm", linear=False,
                               grid=(0.0, 0.06))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d mass, (n, joints, 1): mass 1, first moment l and second moment l^2 of the last link, l = L + beyond."""
        links, reach = flow.arm.n_links, float(flow.L[-1]) + self.beyond[0]
        rigid = RigidBody.of_arm(flow.arm).columns(flow)
        last = [rigid[..., k * links + links - 1] for k in range(3)]
        return (last[0] + reach * last[1] + reach**2 * last[2])[..., None]

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"The tip carries a payload of {text['mass']} that arm.yaml does not state. Its centre lies {text['beyond']} beyond the "
                "end of the link.")
