"""Model folders: model.json (schema, arm, filter, terms, provenance), weights.safetensors where there are tensors, and a digest of both.

Nothing in them is executed: JSON and safetensors only. The digest tells whether a file was changed after it was written.
"""

import hashlib
import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from torch import Tensor

from nnhydro import __version__
from nnhydro.conventions import SCHEMA_MODEL
from nnhydro.effects.catalogue import catalogue, instrument_of
from nnhydro.errors import ModelError, NnhydroError
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.learned.learned import BASELINE, FREE, LAW, WATER, LearnedTorque, memory_filters
from nnhydro.models.learned.linear_parts import FreePart, StripLaw
from nnhydro.models.learned.network import Ensemble
from nnhydro.models.learned.strip_net import StripNet
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm, parse_arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.runtime.files import json_text, read_json, whole_folder

MODEL, WEIGHTS, DIGEST = "model.json", "weights.safetensors", "digest.txt"
MAX_BYTES = 500_000_000
LONGEST_NAME = 200  # as that of an arm


def _digest(folder: Path) -> str:
    """The sha256 of the model file and its weights, in hex."""
    digest = hashlib.sha256()
    for name in (MODEL, WEIGHTS):
        if (folder / name).exists():
            digest.update(name.encode() + (folder / name).read_bytes())
    return digest.hexdigest()


def save_model(model: TorqueModel, out: Path) -> Path:
    """Write `model` to the folder `out`, whole or not at all; an existing model folder is replaced. Returns `out`."""
    from safetensors.torch import save

    document = {"schema": SCHEMA_MODEL, "kind": model.kind, "arm": model.arm.document(), "preparation": model.preparation.document(),
                "conventions": "torques are what the drives supply; C_M is the added-mass coefficient; angles joint-relative",
                "model": model.document(), "fit": model.fit}
    with whole_folder(out, DIGEST) as work:
        (work / MODEL).write_text(json_text(document), encoding="utf-8")
        if model.arrays():
            (work / WEIGHTS).write_bytes(save({name: tensor.contiguous() for name, tensor in model.arrays().items()}))
        (work / DIGEST).write_text(_digest(work) + "\n", encoding="utf-8")
    return out


def _model_name(document: dict[str, Any]) -> str:
    """The name of a model: one line of at most LONGEST_NAME printable characters, for it goes to terminals and exported files."""
    name = document["name"]
    if not (isinstance(name, str) and name.isprintable() and 0 < len(name) <= LONGEST_NAME):
        raise ModelError(f"its name {name!r:.80} is not one line of 1 to {LONGEST_NAME} printable characters: make the model again")
    return name


def _strip_theory(document: dict[str, Any], tensors: dict[str, Tensor], arm: Arm, how: Preparation, fit: dict[str, Any]) -> StripTheory:
    catalogue()  # confirmed hypotheses are terms too
    instruments = tuple(instrument_of(record) for record in document.get("instruments", []))
    return StripTheory(arm, how, fit, _model_name(document), Loads.parse(document["terms"]), instruments)


def _read_learned(document: dict[str, Any], tensors: dict[str, Tensor], arm: Arm, how: Preparation, fit: dict[str, Any]) -> LearnedTorque:
    """The network or hybrid that a model file describes; raises ModelError for one of an incompatible version."""
    if "law" not in document:
        raise ModelError("was trained by a version whose networks had no law of the strips: train it again on its recordings")
    water = {key.removeprefix(WATER): t for key, t in tensors.items() if key.startswith(WATER)}
    if document.get("bank") != memory_filters(bool(water)):
        raise ModelError("was trained by a version whose strips remembered their motion in another way: train it again on its recordings")
    layers = int(document["layers"])
    ordered = [tensors[f"ensemble.{i}"] for i in range(2 * layers)]
    ensemble = Ensemble(tuple(ordered[:layers]), tuple(ordered[layers:]), arm.n_links)
    base, inner = document["baseline"], {key.removeprefix(BASELINE): t for key, t in tensors.items() if key.startswith(BASELINE)}
    scaling = {key: tensors[key] for key in ("floor", "centre", "spread", "parity", "lowest", "highest", "swiftest", "skip")}
    names = document["law"]
    law = None if names is None else StripLaw(tuple(names), *(tensors[f"{LAW}{field.name}"] for field in fields(StripLaw)[1:]))
    free = FreePart.of_arrays({key.removeprefix(FREE): t for key, t in tensors.items() if key.startswith(FREE)}) \
        if f"{FREE}coefficients" in tensors else None
    made = None if base is None else _KINDS[base["kind"]](base["model"], inner, parse_arm(base["arm"], MODEL), how, {})
    return LearnedTorque(arm, how, fit, tuple(document["features"]), float(document["bound"]), **scaling, ensemble=ensemble,
                         baseline=made, law=law, free=free, water=StripNet(**water) if water else None,
                         support=tensors.get("support"), trust=tensors.get("trust"), doubt=tensors.get("doubt"), share=tensors.get("share"))


def _read_corrected(document: dict[str, Any], tensors: dict[str, Tensor], arm: Arm, how: Preparation,
                    fit: dict[str, Any]) -> CorrectedSimulation:
    inner = document["simulation"]
    made = None if inner is None else _KINDS[inner["kind"]](inner["model"], tensors, parse_arm(inner["arm"], MODEL), how, {})
    before, after = (_strip_theory(document[name], {}, arm, how, {}) for name in ("before", "after"))
    return CorrectedSimulation(arm, how, fit, made, before, after)


_KINDS = {StripTheory.kind: _strip_theory, LearnedTorque.kind: _read_learned, CorrectedSimulation.kind: _read_corrected}


def _who_reads(schema: Any) -> str:
    """Which version reads a model of another schema: its number grows with every change that older versions would misread."""
    parts = re.fullmatch(r"nnhydro/model/(\d{1,6})", schema) if isinstance(schema, str) else None
    if parts is None:
        return "was this written by nnhydro?"
    newer = int(parts[1]) > int(SCHEMA_MODEL.rpartition("/")[2])
    return "a later version of nnhydro wrote it: update nnhydro" if newer else "make the model again"


def _try_out(model: TorqueModel) -> TorqueModel:
    """Return `model` if it gives finite torques for an arm at rest and one that moves; raises ValueError, RuntimeError where not."""
    links = np.ones((2, model.arm.n_links)) * [[0.0], [0.5]]
    if not isinstance(model.fit, dict) or not bool(model.torque(Motion.at(links, links, links, links[:, 0])).isfinite().all()):
        raise ValueError("its numbers do not fit together")
    return model


def _read_document(folder: Path) -> dict[str, Any]:
    """The document of a model folder whose digest matches; raises ModelError otherwise."""
    if not (folder / MODEL).is_file():
        raise ModelError(f"{folder}: is not a model folder (no {MODEL}): nnhydro identify, train and diagnose write them")
    if sum(path.stat().st_size for path in folder.iterdir() if path.is_file()) > MAX_BYTES:
        raise ModelError(f"{folder}: larger than {MAX_BYTES} bytes: is this a model of ours?")
    stored = (folder / DIGEST).read_bytes().strip() if (folder / DIGEST).is_file() else b""
    if stored != _digest(folder).encode():
        raise ModelError(f"{folder}: its files do not match {DIGEST}: they were changed after the model was written; make it again")
    document = read_json(folder / MODEL, ModelError)
    found = document.get("schema")
    if found != SCHEMA_MODEL:
        raise ModelError(f"{folder / MODEL}: schema {found!r:.80}: nnhydro {__version__} reads {SCHEMA_MODEL!r}; {_who_reads(found)}")
    return document


def load_model(folder: Path) -> TorqueModel:
    """Return the model in `folder`; raises ModelError with one line where it is missing, changed or not understood."""
    from safetensors import SafetensorError
    from safetensors.torch import load_file

    document = _read_document(folder)
    try:
        stored = load_file(folder / WEIGHTS) if (folder / WEIGHTS).exists() else {}
        tensors = {name: x.clone() for name, x in stored.items()}  # in memory of their own: sums depend, in the last bit, on where they lie
        arm = parse_arm(document["arm"], str(folder / MODEL))
        how = Preparation.parse(document["preparation"])
        return _try_out(_KINDS[document["kind"]](document["model"], tensors, arm, how, document["fit"]))
    except NnhydroError as cause:
        raise ModelError(f"{folder}: {cause}") from cause
    except (KeyError, TypeError, AttributeError, ValueError, IndexError, OverflowError, RuntimeError, SafetensorError) as cause:
        raise ModelError(f"{folder}: cannot be understood ({type(cause).__name__}: {str(cause)[:200]}): make the model again") from cause
