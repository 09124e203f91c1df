"""Measured and modelled torque of one recording, computed once for every picture of a page."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.evaluation.benchmark_result import BenchmarkResult
from nnhydro.evaluation.metrics import Misfit
from nnhydro.evaluation.model_errors import model_torque
from nnhydro.fitting.linear.several_arms import arm_of, on_arm
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
MOST = 60  # recordings on a page
BASELINE, CORRECTED = "baseline", "corrected"  # the models of a diagnosis


@final
@dataclass(frozen=True, eq=False)
class Trace:
    """One gap-free stretch of a recording, or a bunch of steady runs, with the torque (n, joints) N m of every model."""

    recording: str
    segment: Segment
    models: Mapping[str, Array]

    @property
    def tau(self) -> Array:
        """Measured torque (n, joints) N m."""
        assert self.segment.tau is not None
        return self.segment.tau

    def residual(self, model: str) -> Array:
        """Return measured minus modelled torque (n, joints) N m."""
        return self.tau - self.models[model]

    def error(self, model: str) -> float:
        """Return sum |residual| / sum |torque| over the compared rows."""
        keep = self.segment.keep
        return Misfit.of(self.tau[keep], self.models[model][keep]).error

    def error_text(self, model: str) -> str:
        """Return the error in percent; where no torque was measured, as of a free machine, the mean |residual| in N m (N)."""
        keep = self.segment.keep
        if self.tau[keep].any():
            return f"{100 * self.error(model):.1f} %"
        return f"{np.abs(self.residual(model)[keep]).mean():.2g} {'N' if self.segment.sliding else 'N m'}"


def _torque(model: TorqueModel, segment: Segment) -> Array:
    """The model's torque as it is compared; of a change to a simulation outside, that simulation's torque with it."""
    tau = model_torque(model, segment)
    outside = isinstance(model, CorrectedSimulation) and model.simulation is None
    return tau + segment.tau_sim if outside and segment.tau_sim is not None else tau


def bin_edges(values: Array, bins: int, beyond: float) -> Array:
    """Return the edges (bins + 1,) of even bins over the range of `values` (n,) without the share `beyond` at either end."""
    low, high = np.quantile(values, [beyond, 1 - beyond])
    return np.linspace(low, high if high > low else low + 1.0, bins + 1)


def traces_of(recording: str, segments: Iterable[Segment], models: Mapping[str, TorqueModel]) -> list[Trace]:
    """Return a trace a segment that has torques and rows to compare."""
    return [Trace(recording, segment, {name: _torque(model, segment) for name, model in models.items()})
            for segment in segments if segment.tau is not None and segment.keep.any()]


def _joined_segments(segments: Sequence[Segment]) -> Segment:
    """Steady runs of several bunches as one segment."""
    def rows(name: str) -> Any:
        return np.concatenate([getattr(segment, name) for segment in segments])

    count = sum(len(segment) for segment in segments)
    return replace(segments[0], t=np.arange(count, dtype=float), tau_sim=None, tau_raw=None,
                   **{name: rows(name) for name in ("q", "qd", "qdd", "u0", "du0", "tau", "keep")})


def table_of(recording: str) -> str:
    """Return the recording, or the steady table that a bunch of its runs belongs to."""
    return recording.split("#")[0]


def with_whole_tables(traces: Sequence[Trace]) -> list[Trace]:
    """Return the traces with the bunches of each steady table put together, tables last."""
    moving = [trace for trace in traces if not trace.segment.steady]
    for name in dict.fromkeys(table_of(trace.recording) for trace in traces if trace.segment.steady):
        parts = [trace for trace in traces if trace.segment.steady and table_of(trace.recording) == name]
        models = {model: np.concatenate([part.models[model] for part in parts]) for model in parts[0].models}
        moving.append(Trace(name, _joined_segments([part.segment for part in parts]), models))
    return moving


def spread(names: Sequence[str], most: int = MOST) -> list[str]:
    """Return at most `most` of `names`, evenly over their order."""
    if len(names) <= most:
        return list(names)
    return [names[i] for i in np.unique(np.linspace(0, len(names) - 1, most).round().astype(int))]


def diagnosis_traces(campaign: Campaign, baseline: TorqueModel, corrected: TorqueModel) -> list[Trace]:
    """Return the traces of at most as many recordings as a page holds, and of the steady tables, of both models of a diagnosis."""
    models = {CORRECTED: corrected, BASELINE: baseline}
    found: list[Trace] = []
    for name in spread(campaign.names):
        found += traces_of(name, campaign.segments(name, corrected.preparation), models)
    for table, segment in zip(campaign.steady, campaign.steady_segments(), strict=True):
        found += traces_of(table.name, [segment], models)
    return found


def by_change(traces: Sequence[Trace]) -> list[Trace]:
    """Return the traces of a diagnosis, those on which the correction helps most first, steady tables last."""
    return sorted(with_whole_tables(traces), key=lambda t: (t.segment.steady, t.error(CORRECTED) - t.error(BASELINE)))


def benchmark_traces(result: BenchmarkResult, names: Sequence[str]) -> list[Trace]:
    """Return the held-out torques of the units `names`, each by the models of the fold that left it out."""
    found: list[Trace] = []
    index = {unit.name: i for i, unit in enumerate(result.units)}
    for name in names:
        fold = max(k for k, held_out in enumerate(result.folds) if index[name] in held_out)
        unit = result.units[index[name]]
        models = {model: on_arm(standing.models[fold], arm_of(unit, standing.models[fold].arm))
                  for model, standing in result.standings.items()}
        found += traces_of(name, unit.segments(), models)
    return found
