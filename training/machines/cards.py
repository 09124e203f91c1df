"""Cards of the machines: what each is, what it hides, which names are right; writes their campaigns. Nothing of the package."""

import inspect
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

Maker = Callable[[np.random.Generator], tuple[Any, ...]]  # gives arm.yaml's document, recordings, card, and at times a steady table
MACHINES: dict[int, tuple[str, Maker]] = {}  # number: kind and maker


def machine(number: int, kind: str) -> Callable[[Maker], Maker]:
    """Enter a function as the maker of a machine; its docstring says what the machine is."""
    def enter(function: Maker) -> Maker:
        MACHINES[number] = (kind, function)
        return function
    return enter


def hidden(effect: str, joint: int | None = None, accept: Sequence[str] = (), partial: Sequence[str] = (),
           **values: tuple[float, str]) -> dict[str, Any]:
    """Return what is hidden, by the catalogue's name; values: name=(number, unit).

    accept: names that are as right here. partial: names that are half right.
    """
    return {"effect": effect, "joint": joint, "accept": list(accept), "partial": list(partial),
            "values": {name: {"value": float(number), "unit": unit} for name, (number, unit) in values.items()}}


def card(answers: Sequence[dict[str, Any]] = (), tolerated: Sequence[str] = (), note: str = "", nameless: bool = False,
         baseline: str | None = None) -> dict[str, Any]:
    """Return a machine's card; tolerated: names that are neither right nor wrong. nameless: no name of the catalogue is right."""
    return {"healthy": not answers and not nameless, "nameless": nameless, "answers": list(answers), "tolerated": list(tolerated),
            "note": note, "baseline": baseline}


def write(number: int, seed: int, folder: Path) -> dict[str, Any]:
    """Write the campaign of a machine to `folder`, in place of what is there, and return its card."""
    kind, maker = MACHINES[number]
    arm, recordings, facts, *steady = maker(np.random.default_rng(seed + number))
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "arm.yaml").write_text(yaml.safe_dump(arm, sort_keys=False))
    tables = {f"recordings/run{k:02d}.csv": table for k, table in enumerate(recordings)}
    if steady:
        tables["steady/table.csv"] = steady[0]
    for name, table in tables.items():
        (folder / name).parent.mkdir(exist_ok=True)
        table.to_csv(folder / name, index=False, float_format="%.8g")
    return {"kind": kind, "what": inspect.getdoc(maker), **facts}
