"""Several instrument effects at once: each acts on what those before it leave, in the order of `stage`."""

from collections.abc import Sequence
from dataclasses import replace

from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect
from nnhydro.effects.sensor_view import SensorView
from nnhydro.physics.flow import Flow


def with_effects(seen: SensorView, effects: Sequence[InstrumentEffect]) -> SensorView:
    """Return the view whose `torque_of` holds all of `effects`: its `tau` is the reading with them."""
    for effect in sorted(effects, key=lambda effect: effect.stage):
        seen = _with_effect(seen, effect)
    return seen


def _with_effect(seen: SensorView, effect: InstrumentEffect) -> SensorView:
    """The view after one effect more: torques of any flow are then those that this effect makes of them."""
    inner = seen

    def torque_of(flow: Flow) -> Tensor:
        return effect.apply(replace(inner, flow=flow))

    return replace(seen, torque_of=torque_of)
