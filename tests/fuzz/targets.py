"""Everything that reads what comes from outside, as functions of bytes: a reader gives a result or one line (NnhydroError), nothing else.

Used by tests/fuzz/test_corpus.py, which replays every input that ever failed, and by training/reliability/fuzz.py, which looks for more.
"""

import io
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nnhydro.blind_tests.reveal import _predicted_files, read_suite
from nnhydro.blind_tests.scoring import score
from nnhydro.blind_tests.seal import open_sealed, read_key, seal
from nnhydro.blind_tests.summary import summary
from nnhydro.deployment.formats.urdf import read_urdf
from nnhydro.errors import ConfigError, NnhydroError
from nnhydro.fitting.config import read_config
from nnhydro.fitting.network.gradient_fit import TrainingState
from nnhydro.models.learned.network import Ensemble
from nnhydro.models.prediction import predict
from nnhydro.models.storage import DIGEST, MODEL, WEIGHTS, _digest, load_model, save_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.recordings.arm import parse_arm, read_arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation, plan, prepare
from nnhydro.recordings.readers.column_map import read_column_map
from nnhydro.recordings.readers.files import read_recording, read_steady
from nnhydro.recordings.recording import Recording
from nnhydro.recordings.survey import survey
from nnhydro.runtime.files import read_json
from nnhydro.simulation.recipe.recipe import read_recipe

LINK = {"length_m": 0.55, "diameter_m": 0.07, "mass_kg": 1.0, "com_m": 0.27, "inertia_kg_m2": 0.026}
ARM = parse_arm({"fluid": {"density_kg_m3": 1000.0}, "links": [LINK]}, "arm")
COLUMNS = ("t_s", "q1_rad", "tau1_Nm", "dq1_rad_s", "u0_m_s")
ROWS = 40
KEY = bytes(range(32))
ANSWER = {"kind": "effect", "strength": "strong", "limit": 0.5, "unseen": {}, "effects": [
    {"effect": "payload_mass", "family": "inertia", "joint": None, "shape": "plain", "near": [],
     "parameters": {"mass": {"value": 0.5, "unit": "kg"}}}]}


@dataclass(frozen=True)
class Target:
    """One reader: the name of the file that it reads, files to begin with, and what is done with the file."""

    name: str
    file: str
    seeds: tuple[bytes, ...]
    read: Callable[[Path], object]
    text: bool = True

    def __call__(self, data: bytes, place: Path) -> bool:
        """Read `data` as a file in `place`; return whether it was accepted; anything but NnhydroError passes through."""
        path = place / self.file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        try:
            self.read(path)
        except NnhydroError as error:
            said = str(error)
            if not said or len(said) > 2000:
                raise AssertionError(f"a line of {len(said)} characters helps nobody") from error
            return False
        return True


def _channels(rows: int = ROWS) -> dict[str, np.ndarray]:
    t = np.arange(rows) / 50
    return dict(zip(COLUMNS, (t, np.sin(t), np.cos(3 * t), np.cos(t), 0.1 * t), strict=True))


def _csv(columns: dict[str, np.ndarray], delimiter: str = ",") -> bytes:
    lines = [delimiter.join(columns), *(delimiter.join(f"{x:.6g}" for x in row) for row in zip(*columns.values(), strict=True))]
    return ("\n".join(lines) + "\n").encode()


def _recording(path: Path) -> None:
    """Read a recording and do with it what `nnhydro check` does."""
    recording = read_recording(path, ARM)
    how = plan(iter([recording]))
    for _ in prepare(recording, how):
        pass
    if path.stat().st_size % 8 == 0:  # the checks take ten times as long as the reading
        survey(Campaign.of(ARM, [recording]))


def _parquet(**options: Any) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    file = io.BytesIO()
    pq.write_table(pa.table(_channels()), file, **options)
    return file.getvalue()


def _hdf5(**options: Any) -> bytes:
    import h5py

    memory = io.BytesIO()
    with h5py.File(memory, "w") as file:
        for name, values in _channels().items():
            file.create_dataset(name, data=values, **options)
    return memory.getvalue()


def _hdf5_table() -> bytes:
    import h5py

    memory, columns = io.BytesIO(), _channels()
    with h5py.File(memory, "w") as file:
        table = np.zeros(ROWS, dtype=[(name, "f8") for name in columns])
        for name, values in columns.items():
            table[name] = values
        file["run/table"] = table
    return memory.getvalue()


def _bag(kind: str) -> bytes:
    """A bag of joint states, in the format `kind`: bag, mcap or db3."""
    import tempfile

    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
    names = ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    State, Header, Time = (store.types[name] for name in names)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / ("x.bag" if kind == "bag" else "x")
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        with (Writer1(path) if kind == "bag" else Writer2(path, version=9, storage_plugin=plugin)) as writer:
            connection = writer.add_connection("/joint_states", State.__msgtype__, typestore=store)
            for row in range(12):
                extra = {"seq": row} if kind == "bag" else {}
                header = Header(stamp=Time(1, row * 10_000_000), frame_id="", **extra)
                message = State(header, ["joint1"], np.array([0.1 * row]), np.array([1.0]), np.array([2.0 + row]))
                serialised = store.serialize_ros1 if kind == "bag" else store.serialize_cdr
                writer.write(connection, row * 10_000_000 + 1, serialised(message, State.__msgtype__))
        return (path if kind == "bag" else next(path.glob(f"*.{kind}"))).read_bytes()


def _model() -> StripTheory:
    loads = Loads({"rigid_body": RigidBody.of_arm(ARM), "normal_drag": NormalDrag((1.0,)), "added_mass": AddedMass((0.8,))})
    return StripTheory(ARM, Preparation(None), {}, "constant", loads)


def _stored(name: str) -> bytes:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        return (save_model(_model(), Path(folder) / "m") / name).read_bytes()


def _load(path: Path) -> None:
    """Load the model whose document is `path`, its digest made to fit, and predict with it."""
    (path.parent / WEIGHTS).unlink(missing_ok=True)
    (path.parent / DIGEST).write_text(_digest(path.parent) + "\n")
    model = load_model(path.parent)
    if model.arm.n_links == 1:
        columns = _channels()
        predict(model, Recording("run", columns["t_s"], columns["q1_rad"][:, None]))


def _checkpoint() -> bytes:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        TrainingState.fresh(Ensemble.fresh((3, 2, 1), 1, 0)).save(Path(folder) / "c")
        return (Path(folder) / "c").read_bytes()


def _diagnosis(path: Path) -> None:
    summary([score("campaign_000", ANSWER, read_json(path, ConfigError), str(path))], [])


DIAGNOSIS = {"schema": "nnhydro/diagnosis/1", "seconds": 8.1, "mismatch": {"detected": True, "p_value": 0.001}, "findings": [
    {"effect": "payload_mass", "family": "inertia", "class": ["payload_mass"], "joint": None, "confidence": 0.97,
     "parameters": {"mass": {"value": 0.5, "unit": "kg", "ci95": [0.4, 0.6]}}}], "unexplained": {"detected": False}}
ARM_YAML = b"""schema: nnhydro/arm/1
name: arm
fluid: {density_kg_m3: 1000.0, kinematic_viscosity_m2_s: 1.0e-6}
gravity_m_s2: 0.0
drive: {kind: remote, pulley_ratio: 1.0, angle2: absolute}
gear: {ratio: 10, efficiency: 0.9, torque_at: motor}
links:
  - {length_m: 0.55, diameter_m: 0.07, mass_kg: 1.0, com_m: 0.27, inertia_kg_m2: 0.026}
  - {length_m: 0.45, diameter_m: 0.06, mass_kg: 1.4, com_m: 0.22, inertia_kg_m2: 0.024, known_to: 0.05}
"""
MAP = b"""columns:
  t_s: {from: "Time (ms)", unit: ms}
  q1_rad: {from: shoulder, unit: deg, sign: -1, offset: 90}
  u0_m_s: carriage
steady: {tau1_Nm: {from: mean T1, unit: N mm}}
joints: [shoulder, elbow]
topic: /joint_states
"""
CONFIG = b"""model = "hybrid"
baseline = "constant"
hidden = [32, 32]
members = 6
bound = 4.0
epochs = 40
features = ["morison", "wake"]
seed = 3
"""
RECIPE = b"""schema: nnhydro/recipe/1
seed: 1
sample_rate_hz: 50
arm: {schema: nnhydro/arm/1, fluid: {density_kg_m3: 1000.0}, links: [
  {length_m: 0.55, diameter_m: 0.07, mass_kg: 1.0, com_m: 0.27, inertia_kg_m2: 0.026}]}
terms: {rigid_body: arm, normal_drag: {C_D: 1.0}, added_mass: {C_M: 0.8}}
controller: {kind: pd, kp: 60, kd: 6}
sensors: {encoder_counts_per_rev: 65536, torque_noise_Nm: 0.02}
limits: {q_rad: [[-9.0, 9.0]], dq_rad_s: 30.0, u0_m_s: 2.0}
motions:
  - {kind: slew, name: reach, q_rad: [[-0.8], [0.6]], duration_s: 1.2, pause_s: 0.4}
  - {kind: fourier, name: swim, q_rad: [0.0], duration_s: 2.0, reach_rad: [1.2], rate_rad_s: 2.0}
  - {kind: rotation, name: turn, q_rad: [-1.5], dq_rad_s: [0.8], hold_s: 1.5}
  - {kind: tow, name: tow, q_rad: [0.3], hold_s: 1.0, carriage: {u0_m_s: 0.8, ramp_s: 0.5}}
  - {kind: file, name: file, file: ../../secret.csv, low_pass_hz: 3}
  - {kind: steady, name: grid, u0_m_s: [0.3, 0.8], q_rad: [[-0.52, 0.0, 0.52]]}
unseen: [reach]
"""
FILE = b"  - {kind: file, name: file, file: ../../secret.csv, low_pass_hz: 3}\n"
CONTROLLER = b"controller: {kind: pd, kp: 60, kd: 6}\n"
URDF = b"""<robot name="arm"><link name="base"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 0 1"/>
<dynamics damping="0.1" friction="0.2"/></joint>
<link name="a"><inertial><origin xyz="0.2 0 0"/><mass value="1.5"/>
<inertia ixx="0.1" iyy="0.1" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0.25 0 0" rpy="0 1.5708 0"/><geometry><cylinder radius="0.03" length="0.5"/></geometry></collision></link>
<joint name="j2" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/></joint>
<link name="b"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.2"/></inertial>
<visual><geometry><cylinder radius="0.03" length="0.4"/></geometry></visual></link>
<joint name="f" type="fixed"><parent link="b"/><child link="tip"/><origin xyz="0.4 0 0"/></joint><link name="tip"/></robot>
"""


def targets() -> dict[str, Target]:
    """Return every target by name."""
    sealed = json.dumps(seal("campaign_000", ANSWER, KEY).document()).encode()
    suite = json.dumps({"schema": "nnhydro/suite/1", "campaigns": {"campaign_000": {"baseline": "constant", "commitment": "ab"}}}).encode()
    steady = {"run": np.arange(5), **{name: values[:5] for name, values in _channels().items() if name != "t_s"}}
    plain = RECIPE.replace(FILE, b"")
    found = [
        Target("csv", "recordings/x.csv", (_csv(_channels()), _csv(_channels(), ";")), _recording),
        Target("steady csv", "steady/x.csv", (_csv(steady),), lambda path: read_steady(path, ARM)),
        Target("predicted csv", "x.csv", (_csv({name: _channels()[name] for name in ("t_s", "tau1_Nm")}),),
               lambda path: _predicted_files(path.parent)("x")),
        Target("parquet", "recordings/x.parquet", (_parquet(), _parquet(compression="zstd", use_dictionary=False)), _recording, False),
        Target("hdf5", "recordings/x.h5", (_hdf5(), _hdf5(chunks=(10,), compression="gzip"), _hdf5_table()), _recording, False),
        Target("mcap", "recordings/x.mcap", (_bag("mcap"),), _recording, False),
        Target("db3", "recordings/x.db3", (_bag("db3"),), _recording, False),
        Target("bag", "recordings/x.bag", (_bag("bag"),), _recording, False),
        Target("urdf", "x.urdf", (URDF,), read_urdf),
        Target("arm.yaml", "arm.yaml", (ARM_YAML,), read_arm),
        Target("columns.yaml", "columns.yaml", (MAP,), read_column_map),
        Target("recipe", "recipe.yaml", (plain, plain.replace(CONTROLLER, b""), RECIPE), read_recipe),
        Target("config", "config.toml", (CONFIG,), read_config),
        Target("model.json", f"m/{MODEL}", (_stored(MODEL),), _load),
        Target("checkpoint", "c.safetensors", (_checkpoint(),), TrainingState.load, False),
        Target("key", "key.txt", (KEY.hex().encode(),), read_key),
        Target("sealed answer", "campaign_000.sealed", (sealed,), lambda path: open_sealed(path, KEY)),
        Target("suite.json", "suite/suite.json", (suite,), lambda path: read_suite(path.parent)),
        Target("diagnosis.json", "diagnosis.json", (json.dumps(DIAGNOSIS).encode(),), _diagnosis),
    ]
    return {target.name: target for target in found}

