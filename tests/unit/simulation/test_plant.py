"""The arm as a mechanical system: mass matrix, acceleration, and what cannot be stepped."""

from typing import Any

import numpy as np
import pytest
import torch

from nnhydro.errors import ConfigError
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.arm import Arm, parse_arm
from nnhydro.simulation.plant import Plant, require_steps
from nnhydro.simulation.recipe.true_loads import true_loads

LINK = {"length_m": 0.5, "diameter_m": 0.06, "mass_kg": 1.2, "com_m": 0.25, "inertia_kg_m2": 0.025}
TERMS: dict[str, Any] = {"normal_drag": {"C_D": 1.0}, "added_mass": {"C_M": 0.8}}


def arm(links: int = 2, **more: Any) -> Arm:
    return parse_arm({"fluid": {"density_kg_m3": 1000.0}, "links": [LINK] * links, **more}, "arm")


@pytest.mark.parametrize("links", [1, 2, 3])
def test_the_acceleration_under_a_torque_is_the_one_whose_inverse_dynamics_gives_that_torque(links: int) -> None:
    of = arm(links)
    plant = Plant(of, true_loads(TERMS, of, "r"))
    rng = np.random.default_rng(1)
    q, qd, tau = (tensor(rng.normal(size=(20, links))) for _ in range(3))
    t, u0, du0 = torch.zeros(20, dtype=torch.float64), tensor(rng.normal(size=20)), tensor(rng.normal(size=20))
    qdd = plant.acceleration(tau, t, q, qd, u0, du0)
    back = plant.loads.torque(Flow(of, Motion(t, q, qd, qdd, u0, du0)))
    np.testing.assert_allclose(back, tau, atol=1e-10)
    mass, _ = plant.mass_and_rest(t, q, qd, u0, du0)
    assert torch.linalg.eigvalsh((mass + mass.transpose(1, 2)) / 2).min() > 0


def test_a_torque_at_one_joint_from_the_acceleration_of_another_stands_in_its_row_of_the_mass_matrix() -> None:
    of = arm()
    plant = Plant(of, Loads({"leak": _Leak()}))
    zero, still = torch.zeros(1, dtype=torch.float64), torch.zeros(1, 2, dtype=torch.float64)
    np.testing.assert_array_equal(plant.mass_and_rest(zero, still, still, zero, zero)[0][0], [[1.0, 0.5], [0.0, 1.0]])


def test_an_arm_without_inertia_cannot_be_controlled() -> None:
    of = parse_arm({"fluid": {"density_kg_m3": 0.0}, "links": [{**LINK, "mass_kg": 0.0, "inertia_kg_m2": 0.0}]}, "arm")
    plant = Plant(of, true_loads({}, of, "r"))
    with pytest.raises(ConfigError, match="no inertia"):
        plant.require_inertia(torch.zeros(1, dtype=torch.float64), torch.zeros(1, 1, dtype=torch.float64), torch.zeros(1))


class _Lagging(LoadTerm):
    def torque(self, flow: Flow) -> torch.Tensor:
        return flow.motion.qd.abs().cumsum(dim=0)


class _Leak(LoadTerm):
    def torque(self, flow: Flow) -> torch.Tensor:
        return flow.motion.qdd @ torch.tensor([[1.0, 0.0], [0.5, 1.0]], dtype=torch.float64)


class _Squared(LoadTerm):
    def torque(self, flow: Flow) -> torch.Tensor:
        return flow.motion.qdd**2


@pytest.mark.parametrize(("term", "message"), [(_Lagging(), "terms.odd: depends on the motion before.*controller: none"),
                                               (_Squared(), "terms.odd: is not proportional to the acceleration")])
def test_a_term_with_memory_is_refused_under_a_controller(term: LoadTerm, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        require_steps(Loads({"drag": NormalDrag((1.0, 1.0)), "odd": term}), arm())
