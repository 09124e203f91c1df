"""Models of the joint torques: fitted, trained or loaded; they predict, say their parameters, and are stored and exported."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from nnhydro.api.campaign import campaign_of, read_frame
from nnhydro.api.prediction import Prediction
from nnhydro.deployment.compiled.torque import CompiledModel, compile_model
from nnhydro.deployment.files import export_step
from nnhydro.deployment.formats.curves import curves_csv
from nnhydro.deployment.formats.mujoco import mujoco_xml
from nnhydro.errors import ConfigError, require
from nnhydro.fitting.config import TrainingConfig, read_config
from nnhydro.fitting.identify import identify as fit
from nnhydro.fitting.network.gradient_fit import Progress
from nnhydro.fitting.network.train import train as fit_network
from nnhydro.models import prediction, storage
from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.recording import Recording
from nnhydro.report.models.parameter_sheet import model_sentence, parameter_sheet
from nnhydro.runtime.files import write_output
from nnhydro.sheet import ResultView, Sheet

if TYPE_CHECKING:
    import pandas as pd


@final
@dataclass(frozen=True, eq=False, repr=False)
class Model(ResultView):
    """A model of what the arm's torque sensors read; its data frame has one row per parameter.

    `torque_model` is the model that computes (`torque(motion)` on torch tensors, see docs/models.md).
    """

    torque_model: TorqueModel

    @property
    def name(self) -> str:
        """The baseline's name, `network` or `hybrid`."""
        return str(getattr(self.torque_model, "name", self.torque_model.kind))

    @property
    def arm(self) -> Arm:
        """The arm whose torques it predicts."""
        return self.torque_model.arm

    @property
    def fit(self) -> dict[str, Any]:
        """How the model came about: choices, estimates, versions, sha256 of the campaign."""
        return self.torque_model.fit

    def verdict(self) -> str:
        """Return what the model is, in one sentence."""
        return model_sentence(self.torque_model)

    def sheets(self) -> tuple[Sheet, ...]:
        """Return the parameters, or how a network is built."""
        return (parameter_sheet(self.torque_model),)

    def predict(self, motion: "Recording | pd.DataFrame | str | Path", cutoff_hz: float | None = None) -> Prediction:
        """Return what this rig's torque sensors would read for a motion: a row for every row; torque columns are ignored.

        `motion` is a recording, a data frame with its columns, or a file. It is smoothed at `cutoff_hz`, chosen from it by default, unless
        all derivatives are given. Raises RecordingError where it has NaN, ConfigError for a cut-off that it does not hold.
        """
        if isinstance(motion, str | Path):
            motion = read_recording(Path(motion), self.arm, torque=False)
        elif not isinstance(motion, Recording):
            motion = read_frame(motion, self.arm, torque=False)
        return Prediction.of(prediction.predict(self.torque_model, motion, cutoff_hz))

    def export(self, file: str | Path) -> tuple[str, ...]:
        """Write the model for others and return what the file cannot hold: FILE.onnx (one step in time of any model), FILE.xml
        (MuJoCo, physics models) or FILE.csv (C_D and C_M over the distance travelled). Raises ConfigError for another ending.
        """
        out = Path(file)
        if out.suffix == ".onnx":
            return tuple(export_step(self.torque_model, out, "onnx")["left_out"])
        require(out.suffix in (".xml", ".csv"), f"{out}: give a file that ends in .onnx, .xml or .csv", ConfigError)
        made = mujoco_xml(self.torque_model) if out.suffix == ".xml" else None
        write_output(out, curves_csv(self.torque_model) if made is None else made.xml)
        return () if made is None else made.lacks

    def compiled(self, engine: str | None = None) -> CompiledModel:
        """Return the physics model compiled: `torque(motion)` for many states, `step(...)` for one, far faster (docs/speed.md).

        `engine` is numba (extra `fast`) or numpy; by default numba where it is installed. Raises ModelError for a network, or where the
        model remembers the motion in a way that is not compiled.
        """
        return compile_model(self.torque_model, engine)

    def save(self, folder: str | Path) -> Path:
        """Write the model to `folder`, whole or not at all; a model that lies there is replaced. Returns the folder."""
        return storage.save_model(self.torque_model, Path(folder))


def load_model(folder: str | Path) -> Model:
    """Return the model that `Model.save`, `nnhydro identify`, `train` or `diagnose` wrote; raises ModelError with one line."""
    return Model(storage.load_model(Path(folder)))


def identify(campaign: Campaign | str | Path, model: str = "constant", cutoff_hz: float | None = None, seed: int = 0) -> Model:
    """Return a physics model fitted to all recordings, with 95 % intervals over recordings.

    `model` is rigid, textbook, drag-only, constant or state. Raises ConfigError for another name, CampaignError or RecordingError where
    the data cannot be used.
    """
    return Model(fit(campaign_of(campaign), model, cutoff_hz, seed))


def train(campaign: Campaign | str | Path, config: TrainingConfig | str | Path | None = None, checkpoint: str | Path | None = None,
          progress: Progress | None = None) -> Model:
    """Return a network or a hybrid trained on all recordings; a share of them is only watched, for early stopping.

    `config` is a TrainingConfig or a TOML file. With `checkpoint`, an interrupted training goes on from that file. `progress` is called
    with epoch, epochs and the rms validation error over the rms torque that is to be learned. Raises ConfigError or CampaignError.
    """
    chosen = read_config(Path(config)) if isinstance(config, str | Path) else config
    return Model(fit_network(campaign_of(campaign), chosen, None if checkpoint is None else Path(checkpoint), progress))
