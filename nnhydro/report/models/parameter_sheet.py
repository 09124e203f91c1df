"""The parameters of a model as a sheet, with intervals where a fit found them; of a learned model, how it was trained."""

from typing import Any

from nnhydro.effects.in_sector import InSector, ReadInSector
from nnhydro.errors import count_text
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.parametrised import ParametricTerm
from nnhydro.sheet import Column, Sheet, interval


def _values(model: StripTheory) -> dict[str, dict[str, Any]]:
    """Every parameter of the sum and of the instruments by its name, without intervals."""
    found: dict[str, dict[str, Any]] = {}
    named: dict[str, ParametricTerm] = {name: term.term if isinstance(term, InSector) else term for name, term in model.loads.terms.items()}
    named |= {instrument.id: instrument.effect if isinstance(instrument, ReadInSector) else instrument for instrument in model.instruments}
    for name, term in named.items():
        for field in term.parameters():
            values = getattr(term, field.name)
            for number, value in enumerate(values, 1):
                label = f"{name}.{field.name}[{number}]" if len(values) > 1 else f"{name}.{field.name}"
                found[label] = {"value": value, "unit": model.arm.text(field.metadata["unit"])}
    return found


def _physics(model: StripTheory) -> Sheet:
    """Parameters of a physics model with intervals where a fit found them."""
    fitted: dict[str, dict[str, Any]] = model.fit.get("parameters", {})
    rest = {} if fitted else _values(model)
    shown = {**fitted, **rest}
    return Sheet(f"Parameters of {model.name}", (
        Column("parameter", list(shown), words=True), Column("value", [p["value"] for p in shown.values()], "{:.4g}"),
        Column("95 % interval", [tuple(p["ci95"]) if "ci95" in p else None for p in shown.values()], interval, "ci95"),
        Column("unit", [p["unit"] for p in shown.values()], words=True),
        Column("note", [p.get("note") for p in shown.values()], words=True)))


def _learned_sheets(model: LearnedTorque) -> Sheet:
    """Layout and training of a learned model."""
    rows = {"features": ", ".join(model.feature_names), "inputs": len(model.centre),
            "hidden layers": " x ".join(str(w.shape[2]) for w in model.ensemble.weights[:-1]),
            "members": len(model.ensemble.weights[0]), "epochs": model.fit.get("epochs"),
            "recordings": len(model.fit.get("recordings", [])) or None}
    if model.share is not None:
        rows["trained memory"] = f"{' and '.join(f'{100 * w:.0f} %' for w in model.share.tolist())} of the learned torque, by joint"
    return Sheet(f"How {model.name} is built", (Column("what", list(rows), words=True),
                                                Column("is", [None if v is None else str(v) for v in rows.values()], words=True)))


def _use(model: TorqueModel, base: str | None) -> str:
    """How much of what was learned the model uses, where that is not all."""
    nothing = not any(model.fit["best_epoch"])
    text = "; no network improved on its start, so the networks add no torque" if nothing else ""
    if not isinstance(model, LearnedTorque) or model.trust is None or base is None:
        return text
    used = [f"{100 * share:.0f} %" for share in model.trust.tolist()]
    if not bool(model.trust.any()):
        return f"{text}; nothing learned is used: the torques are those of {base}"
    return f"{text}; of what was learned beside {base}, {' and '.join(used)} {'are' if len(used) > 1 else 'is'} used, by joint"


def model_sentence(model: TorqueModel) -> str:
    """Return what the model is, in one sentence."""
    base = getattr(model.baseline, "name", model.baseline.kind) if isinstance(model, LearnedTorque) and model.baseline else None
    name, joints, low_pass = getattr(model, "name", model.kind), model.arm.n_links, model.preparation.low_pass
    text = f"{name}{f' on {base}' if base else ''}, {joints} joint{'s' if joints > 1 else ''}"
    text += "" if low_pass is None else f", low-passed at {low_pass.cutoff_hz:.3g} Hz"
    say = model.arm.text
    if isinstance(model, StripTheory) and "rms_residual_Nm" in model.fit:
        left = ", ".join(f"{x:.3g}" for x in model.fit["rms_residual_Nm"])
        return f"{text}; rms residual by joint {left} {say('N m')}, on the {count_text(model.fit['recordings'], 'recording')} of the fit."
    if "best_epoch" in model.fit:
        best = ", ".join(f"{epoch:g}" for epoch in model.fit["best_epoch"])
        text += f"; trained for {model.fit['epochs']} epochs, lowest validation error at epochs {best}, one for each member"
        return f"{text}{_use(model, base)}."
    return f"{text}."


def parameter_sheet(model: TorqueModel) -> Sheet:
    """Return the parameters of a physics model, or the layout of a learned one."""
    if isinstance(model, CorrectedSimulation):
        return _physics(model.after)
    if isinstance(model, StripTheory):
        return _physics(model)
    if isinstance(model, LearnedTorque):
        return _learned_sheets(model)
    return Sheet(model.kind, (Column("kind", [model.kind], words=True),))
