"""What a hybrid makes of a real arm beside physics: `python training/real_arm/hybrid.py CAMPAIGN`. A few minutes on one core.

One recording left out at a time: the rigid arm, the rigid arm with dry and viscous friction, the network, and the hybrid on the rigid arm
with friction. Prints McLain & Rock's error and the rms residual over the rms torque of each joint; writes runs/<campaign>_hybrid.json.
"""

import sys
import tempfile
import tomllib
from pathlib import Path

from nnhydro.evaluation.metrics import Misfit
from nnhydro.evaluation.model_errors import misfit_of
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import calibrate, versions
from nnhydro.fitting.network.train import train_units
from nnhydro.models.baselines import BASELINES, NamedBaseline
from nnhydro.models.storage import save_model
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.repeats import group_names
from nnhydro.recordings.splitting import Unit, units
from nnhydro.runtime.files import write_json

HERE = Path(__file__).parent


def with_friction(arm: Arm) -> Loads:
    """Return the rigid arm with dry and viscous friction in every joint."""
    n = arm.n_links
    return Loads({"rigid_body": RigidBody.of_arm(arm), "coulomb_friction": CoulombTerm((0.05,) * n),
                  "viscous_friction": ViscousTerm((0.05,) * n)})


FRICTION = NamedBaseline("rigid + friction", "the dry arm with dry and viscous friction", with_friction, calibrated=True)


def fitted(chosen: list[Unit], arm: Arm, how: Preparation) -> dict[str, TorqueModel]:
    """Return the four models, fitted to the units `chosen`."""
    physics = calibrate(FRICTION, chosen, arm, how)
    with tempfile.TemporaryDirectory() as folder:
        inner = str(save_model(physics, Path(folder) / "friction"))
        hybrid = train_units(chosen, arm, how, TrainingConfig(baseline=inner))
    network = train_units(chosen, arm, how, TrainingConfig(model="network"))
    return {"rigid": calibrate(BASELINES["rigid"], chosen, arm, how), FRICTION.name: physics, "network": network, "hybrid": hybrid}


def main() -> None:
    """Leave out one recording at a time, print and store the errors."""
    campaign = open_campaign(Path(sys.argv[1]))
    how = campaign.plan(tomllib.loads((HERE / "config.toml").read_text())["cutoff_hz"])
    every = units(campaign, how, 0, group_names(campaign))
    misfits: dict[str, list[Misfit]] = {}
    for left_out in every:
        models = fitted([unit for unit in every if unit.group != left_out.group], campaign.arm, how)
        for name, model in models.items():
            misfits.setdefault(name, []).append(misfit_of(model, left_out))
        print(f"{left_out.name}: " + ", ".join(f"{name} {100 * found[-1].error:.1f} %" for name, found in misfits.items()), flush=True)
    pooled = {name: Misfit.total(found) for name, found in misfits.items()}
    for name, misfit in pooled.items():
        print(f"{campaign.arm.name}, {name}: error {100 * misfit.error:.1f} %, rms {' / '.join(f'{x:.3f}' for x in misfit.nrmse)}")
    write_json(HERE / "runs" / f"{Path(sys.argv[1]).name}_hybrid.json", {
        "error": {name: misfit.error for name, misfit in pooled.items()}, "nrmse": {name: misfit.nrmse for name, misfit in pooled.items()},
        "by_recording": {name: [m.error for m in found] for name, found in misfits.items()}, "campaign_sha256": campaign.sha256(),
        "versions": versions()})


if __name__ == "__main__":
    main()
