"""Loads of the whole arm that are linear in their coefficients and shared by all joints: the dry links, and the flow along them.

    rigid body   what a deviation of one link's mass m, mass centre c or inertia I by `known_to` adds:
                 d(m, h, J) = G d(m, c, I),   h = m c,  J = I + m c^2,   cov = k^2 G diag(m^2, c^2, I^2) G'
    axial        drag 1/2 rho D L |u_x| u_x and added mass rho pi D^2/4 L du_x, one coefficient per link

A baseline settles its masses while it knows nothing of what is learned beside it; here they are found together with the law of the strips,
their coefficients in units of one standard deviation. All columns change sign with the mirror and, without weight, vanish at rest.
Source: physics/loads (Rivera 1995, chapter 3); calibrating physics and residual together: arXiv 2606.19711.
"""

import torch
from torch import Tensor

from nnhydro.features.scaling import gear_ratios
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.axial_added_mass import AxialAddedMass
from nnhydro.physics.loads.axial_drag import AxialDrag
from nnhydro.physics.loads.rigid_body import RigidBody, inertial_directions
from nnhydro.physics.transmission import to_drives


def body_columns(flow: Flow) -> Tensor:
    """Return the sensor torques (n, joints, r + 2 links) N m for coefficients of 1: r inertial directions, axial drag, axial added mass."""
    directions = torch.from_numpy(inertial_directions(flow.arm))
    rigid = RigidBody.of_arm(flow.arm).columns(flow) @ directions
    one = (1.0,) * flow.arm.n_links
    axial = [term.columns(flow) for term in (AxialDrag(one), AxialAddedMass(one))]
    return to_drives(torch.cat([rigid, *axial], dim=2), flow.arm) / gear_ratios(flow.arm)[:, None]
