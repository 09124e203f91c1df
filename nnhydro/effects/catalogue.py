"""All hypotheses: every file of `hypotheses`, installed plug-ins (entry points `nnhydro.effects`) and files given by path.

A plug-in is a Python module that declares effects with `@effect`; reading it runs it, so only files of your own belong here.
"""

from collections.abc import Mapping
from importlib.metadata import entry_points
from itertools import product
from typing import Any

from nnhydro.effects.effect import REGISTER, Effect, InstrumentEffect
from nnhydro.effects.in_sector import ReadInSector
from nnhydro.errors import ConfigError, ModelError, require
from nnhydro.recordings.arm import Arm
from nnhydro.runtime.registry import choices, import_files

GROUP = "nnhydro.effects"
_LOADED: set[str] = set()


def _load_installed() -> None:
    """Import every hypothesis of the package and every installed plug-in."""
    import_files("nnhydro.effects.hypotheses")
    for point in entry_points(group=GROUP):
        try:
            point.load()
        except Exception as cause:
            raise ConfigError(f"plug-in {point.name!r} ({point.value}) cannot be loaded: {type(cause).__name__}: {cause}: mend or "
                              "uninstall it") from cause


def catalogue() -> Mapping[str, type[Effect]]:
    """Return every effect by its id: those of the package in order of family, then plug-ins."""
    if not _LOADED:
        _load_installed()
        _LOADED.add(GROUP)
    ours = [cls for cls in REGISTER.values() if cls.__module__.startswith("nnhydro.effects.")]
    others = [cls for cls in REGISTER.values() if cls not in ours]
    return {cls.id: cls for cls in [*sorted(ours, key=lambda cls: (cls.family, cls.id)), *others]}


def effect_of_id(name: str) -> type[Effect]:
    """Return the effect with the id `name`; raises ConfigError listing the ids."""
    known = catalogue()
    if name not in known:
        raise ConfigError(f"unknown effect {name!r}: {choices(name, known)} (--effects FILE adds your own)")
    return known[name]


USUAL_RATE = 0.5  # rad/s


def candidates(effect: type[Effect], arm: Arm, torque_peak: tuple[float, ...] | None = None,
               rates: tuple[float, ...] = ()) -> tuple[Effect, ...]:
    """Return every (joint, grid point) of `effect` and of its narrower laws that makes sense for `arm`, linear values at their start.

    `torque_peak` (joints,) N m, the largest torque measured at each joint, sets the grids that are given in shares of it
    (`Effect.torque_scaled`): without it, and at a joint that reads nothing at all, such an effect is left out.
    `rates` (joints,) rad/s, the rms rates of the joints, make what happens at low rates happen at lower ones where a joint is slow.
    """
    if effect.torque_scaled and torque_peak is None:
        return ()
    found = []
    for place in effect.places(arm):
        if effect.torque_scaled and torque_peak is not None and not torque_peak[place - 1] > 0:
            continue
        grids = {name: tuple(share * torque_peak[place - 1] for share in grid) if torque_peak and name in effect.torque_scaled else grid
                 for name, grid in effect.grids().items()}
        started = effect.at_start(arm, joint=place)
        if rates:
            started = started.at_pace(rates)
            slow = min(1.0, rates[place - 1] / USUAL_RATE) or 1.0
            grids |= {name: tuple(slow * value for value in grids[name]) for name in effect.rate_scaled}
        found += [_with(law, dict(zip(grids, point, strict=True)))
                  for law in (started, *started.narrower()) if law.acts_on(arm) for point in product(*grids.values())]
    return tuple(dict.fromkeys(found))  # a law without a parameter is one law, whatever its grid


def _with(started: Effect, shape: Mapping[str, float]) -> Effect:
    from dataclasses import replace

    changes: dict[str, Any] = {name: (value,) * len(getattr(started, name)) for name, value in shape.items()}
    return replace(started, **changes)


def instrument_of(document: Mapping[str, Any]) -> InstrumentEffect:
    """Return the instrument effect that `document` (from its `document()`) describes; raises ModelError naming what does not fit."""
    require(isinstance(document, Mapping), f"an instrument effect is an object with a kind, not {document!r:.60}", ModelError)
    kinds: dict[str, type[InstrumentEffect]] = {cls.kind: cls for cls in catalogue().values() if issubclass(cls, InstrumentEffect)}
    kind, options = str(document.get("kind")), document.get("options", {})
    if kind == ReadInSector.kind:
        kinds, options = {kind: ReadInSector}, {**options, "effect": instrument_of(options.get("effect", {}))}
    if kind not in kinds:
        raise ModelError(f"unknown instrument effect {kind!r}: {choices(kind, kinds)}; was it a plug-in of your own?")
    try:
        return kinds[kind](**document.get("parameters", {}), **options)
    except TypeError as cause:
        raise ModelError(f"effect {kind!r}: {cause}") from cause


ACTS = {"joint": "one joint", "link": "one link", "arm": "the whole arm"}


def card(effect: type[Effect]) -> dict[str, Any]:
    """Return the card as JSON holds it."""
    seen = effect.signature
    return {
        "id": effect.id, "family": effect.family, "name": effect.name, "acts": effect.acts,
        "kind": "instrument" if issubclass(effect, InstrumentEffect) else "load", "mechanism": effect.mechanism,
        "equation": effect.equation, "source": effect.source,
        "signature": {"depends_on": list(seen.depends_on), "parity": seen.parity, "region": seen.region, "excited_by": seen.excited_by,
                      "mistaken_for": list(seen.mistaken_for), "zero_at_rest": seen.zero_at_rest},
        "parameters": [{"name": field.name} | {key: field.metadata[key] for key in ("unit", "start", "meaning", "per", "linear")}
                       | {"bounds": list(field.metadata["bounds"]), "grid": list(field.metadata["grid"])} for field in effect.parameters()],
        "own_in_every_recording": effect.per_recording,
    }
