"""Open a suite's sealed answers and score the diagnoses of its campaigns.

    FOLDER/<campaign>/diagnosis.json    the diagnosis
    FOLDER/<campaign>/torques/*.csv     torques predicted for the unseen motions, where there are some; else of FOLDER/<campaign>/model
    FOLDER/<campaign>/baseline          the calibrated baseline, for the error before

The error of unseen motions is McLain and Rock's, sum|tau - prediction| / sum|tau|, pooled over joints, samples and motions, against the
noise-free truth (the mean over its phases where a hidden cause acts by chance). `error_true` is that of the truth itself, given the motions
as they were recorded (true_model.py).
"""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nnhydro.blind_tests.conceal import MARKER
from nnhydro.blind_tests.conceal import SCHEMA as SUITE
from nnhydro.blind_tests.scoring import Verdict, score
from nnhydro.blind_tests.seal import KEY_FILE, open_sealed, read_key
from nnhydro.blind_tests.summary import summary
from nnhydro.errors import ConfigError, NnhydroError, require
from nnhydro.runtime.files import read_json

NAME = re.compile(r"campaign_\d{3}")  # becomes part of paths: nothing else may lead out of the suite
Array = NDArray[np.float64]
Torques = Callable[[str], Array]


def read_suite(suite: Path) -> dict[str, Any]:
    """Return the campaigns of the suite in the folder `suite`: name -> baseline and commitment; raises ConfigError for no such list."""
    require((suite / MARKER).is_file(), f"{suite}: is not a suite of concealed campaigns (no {MARKER}): make one with nnhydro conceal")
    document = read_json(suite / MARKER, ConfigError)
    require(document.get("schema") == SUITE, f"{suite / MARKER}: schema is {document.get('schema')!r:.80}, expected {SUITE!r}")
    campaigns = document.get("campaigns")
    whole = isinstance(campaigns, dict) and all(NAME.fullmatch(name) and isinstance(public, dict) and "commitment" in public
                                                for name, public in campaigns.items())
    require(whole, f"{suite / MARKER}: its list of campaigns is damaged: make the suite again with nnhydro conceal")
    return dict(campaigns or {})


def _predicted_files(folder: Path) -> Torques:
    """Torques by the name of an unseen motion, from CSV files; raises ConfigError for one that does not fit."""
    def torques(name: str) -> Array:
        """Return the predicted torques (n, joints) N m of a motion; raises ConfigError for a file that is none of `nnhydro predict`."""
        path = folder / f"{name}.csv"
        try:
            first, *rows = path.read_text(encoding="utf-8").splitlines() or [""]
            header, table = first.strip().split(","), np.loadtxt(rows, delimiter=",", ndmin=2) if rows else np.zeros((0, 0))
        except (OSError, ValueError) as cause:
            raise ConfigError(f"{path}: cannot be read as predicted torques ({cause}): write it with nnhydro predict") from cause
        columns = [k for k, label in enumerate(header) if label in ("tau1_Nm", "tau2_Nm")]
        require(bool(columns), f"{path}: has no column tau1_Nm: write it with nnhydro predict")
        require(table.shape[1] == len(header), f"{path}: {len(header)} names for {table.shape[1]} columns: write it with nnhydro predict")
        result: Array = table[:, columns]
        return result
    return torques


def _predicted_model(folder: Path, campaign: Path) -> Torques:
    """Torques by the name of an unseen motion, predicted by a model folder."""
    from nnhydro.models.prediction import predict
    from nnhydro.models.storage import load_model
    from nnhydro.recordings.arm import read_arm
    from nnhydro.recordings.readers.files import read_recording

    model, arm = load_model(folder), read_arm(campaign / "arm.yaml")
    return lambda name: predict(model, read_recording(campaign / "unseen" / f"{name}.csv", arm, torque=False)).tau


def unseen_error(unseen: dict[str, Any], torques: Torques) -> float:
    """Return sum|tau - prediction| / sum|tau| over the unseen motions of an answer; raises ConfigError where shapes differ."""
    wrong = total = 0.0
    for name, motion in unseen.items():
        truth, said = np.array(motion["tau_Nm"]), torques(name)
        require(said.shape == truth.shape,
                f"unseen motion {name}: {said.shape} torques were predicted, {truth.shape} are expected: give one for each row")
        wrong, total = wrong + float(np.abs(said - truth).sum()), total + float(np.abs(truth).sum())
    return wrong / total


def _errors(verdict: Verdict, answer: dict[str, Any], folder: Path, campaign: Path) -> Verdict:
    """The verdict with errors on unseen motions: before, after, and of the truth itself."""
    if not answer["unseen"]:
        return verdict
    if all("true_model_Nm" in motion for motion in answer["unseen"].values()):
        true = unseen_error(answer["unseen"], lambda name: np.array(answer["unseen"][name]["true_model_Nm"]))
        verdict = replace(verdict, error_true=true)
    sources: dict[str, Torques | None] = {"error_before": None, "error_after": None}
    notes: list[str] = []
    try:
        if (folder / "baseline").is_dir():
            sources["error_before"] = _predicted_model(folder / "baseline", campaign)
        if (folder / "torques").is_dir():
            sources["error_after"] = _predicted_files(folder / "torques")
        elif (folder / "model").is_dir():
            sources["error_after"] = _predicted_model(folder / "model", campaign)
        found = {key: unseen_error(answer["unseen"], source) for key, source in sources.items() if source is not None}
    except NnhydroError as cause:
        found, notes = {}, [f"unseen motions not scored: {cause}"]
    return replace(verdict, **found, notes=tuple(notes))  # type: ignore[arg-type]


def reveal(suite: Path, diagnoses: Path, key_file: Path | None = None) -> dict[str, Any]:
    """Return the score of the diagnoses in the folder `diagnoses` as a JSON document; raises ConfigError in one line.

    A campaign without a diagnosis is listed as missing and not scored.
    """
    campaigns = read_suite(suite)
    require(diagnoses.is_dir(), f"--diagnoses {diagnoses}: is not a folder: give the one that holds <campaign>/diagnosis.json")
    key = read_key(key_file or suite / KEY_FILE)
    verdicts, missing = [], []
    for name, public in sorted(campaigns.items()):
        answer = open_sealed(suite / "answers" / f"{name}.sealed", key, public["commitment"])
        path = diagnoses / name / "diagnosis.json"
        if not path.is_file():
            missing.append(name)
            continue
        verdict = score(name, answer, read_json(path, ConfigError), str(path))
        verdicts.append(_errors(verdict, answer, path.parent, suite / name))
    first = min(campaigns, default="campaign_000")
    require(bool(verdicts), f"--diagnoses {diagnoses}: holds no diagnosis of {suite}: expected {first}/diagnosis.json")
    return summary(verdicts, missing)
