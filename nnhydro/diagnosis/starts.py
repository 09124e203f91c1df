"""Where the search starts from besides no effect: instruments whose columns about no effect mislead, settled about other values.

A drive that resonates within the motion's band is nothing like its own first order: from there no refinement would reach it.
"""

from collections.abc import Sequence
from dataclasses import replace

from nnhydro.diagnosis.case import Case
from nnhydro.diagnosis.instances import Instance, settled
from nnhydro.diagnosis.table import view
from nnhydro.effects.effect import InstrumentEffect
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion


def started(case: Case, known: Sequence[Instance]) -> tuple[Instance, ...]:
    """Return `known` and the same instruments about the values that their cards name (`starts`), on the baseline's reading."""
    segment = next((s for unit in case.all_units for s in unit.segments() if not s.steady), None)
    if segment is None:
        return tuple(known)
    seen, made = view(case.model, Flow(case.model.arm, Motion.of(segment)), None), []
    for one in known:
        others = one.effect.starts(seen) if isinstance(one.effect, InstrumentEffect) else ()
        tried = replace(one, grid=one.grid * (1 + len(others)))
        made += [tried, *(replace(settled(tried, other.linear_values(), case.model), start=True) for other in others)]
    return tuple(made)
