"""Each recording is held out once: how well a model predicts a new motion of the same campaign."""

from nnhydro.evaluation.protocols.pool import pooled_units
from nnhydro.evaluation.protocols.protocol import DEFAULT, Material, Split, protocol, rounds
from nnhydro.recordings.splitting import folds


@protocol(DEFAULT, "each recording held out once")
def leave_recordings_out(material: Material) -> Split:
    """Return folds that hold out every unit once, repeats of a motion together."""
    units = pooled_units(material)
    parts = folds(units, material.fold_count, material.seed)
    return Split(units, rounds(units, [(f"fold {k + 1}", held_out) for k, held_out in enumerate(parts)]))
