"""A small healthy campaign, flat and without nnhydro's physics, in which tests plant one fault at a time."""

import csv
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import NnhydroError
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.recording import Recording

Columns = dict[str, NDArray[np.float64]]
Fault = Callable[[Columns], Mapping[str, NDArray[np.float64]]]
ARM_YAML = """schema: nnhydro/arm/1
fluid: {density_kg_m3: 1000.0}
links:
  - {length_m: 0.55, diameter_m: 0.07, mass_kg: 1.0, com_m: 0.27, inertia_kg_m2: 0.026}
  - {length_m: 0.45, diameter_m: 0.06, mass_kg: 1.4, com_m: 0.22, inertia_kg_m2: 0.024}
"""
LINKS = (
    {"length_m": 0.55, "diameter_m": 0.07, "mass_kg": 1.0, "com_m": 0.27, "inertia_kg_m2": 0.026},
    {"length_m": 0.45, "diameter_m": 0.06, "mass_kg": 1.4, "com_m": 0.22, "inertia_kg_m2": 0.024},
)


def the_arm(**keys: object) -> Arm:
    """Return the arm of the healthy campaign."""
    return Arm.model_validate({"fluid": {"density_kg_m3": 1000.0}, "links": LINKS, **keys})


def healthy(number: int = 1, rows: int = 1000, rate: float = 100.0, noise: float = 0.02) -> Columns:
    """Return one run from rest to rest: two unlike sines a joint, inertia and quadratic drag, encoder steps and torque noise."""
    rng = np.random.default_rng(number)
    t = np.arange(rows) / rate
    w = 2 * np.pi * np.array([[1, 2], [2, 3]]) / (rows / rate)
    a = np.array([[0.5, 0.2], [0.4, -0.15]]) * (1 + 0.1 * number)
    q = (a[:, :, None] * (1 - np.cos(w[:, :, None] * t))).sum(1).T + 0.2
    qd = (a[:, :, None] * w[:, :, None] * np.sin(w[:, :, None] * t)).sum(1).T
    qdd = (a[:, :, None] * w[:, :, None] ** 2 * np.cos(w[:, :, None] * t)).sum(1).T
    tau = qdd @ np.array([[0.9, 0.2], [0.2, 0.15]]) + np.array([4.0, 0.8]) * qd * np.abs(qd) + noise * rng.standard_normal(q.shape)
    step = 2 * np.pi / 65536
    q = np.round(q / step) * step
    return {"t_s": t, "q1_rad": q[:, 0], "q2_rad": q[:, 1], "dq1_rad_s": qd[:, 0], "dq2_rad_s": qd[:, 1], "tau1_Nm": tau[:, 0],
            "tau2_Nm": tau[:, 1]}


def recording(columns: Columns, name: str = "run1") -> Recording:
    """Return `columns` as a recording."""
    def joints(one: str, two: str) -> NDArray[np.float64] | None:
        return np.column_stack([columns[one], columns[two]]) if one in columns else None

    q = joints("q1_rad", "q2_rad")
    assert q is not None
    return Recording(name, columns["t_s"], q, joints("tau1_Nm", "tau2_Nm"), joints("dq1_rad_s", "dq2_rad_s"), u0=columns.get("u0_m_s"),
                     clock=columns.get("clock_s"))


def campaign(fault: Fault | None = None, in_all: bool = False, arm: Arm | None = None, runs: int = 3) -> Campaign:
    """Return the healthy campaign with `fault` planted in its first run, or in all."""
    found = []
    for number in range(1, runs + 1):
        columns = healthy(number)
        if fault is not None and (in_all or number == 1):
            columns = {**columns, **fault(columns)}
        found.append(recording(columns, f"run{number}"))
    return Campaign.of(arm or the_arm(), found)


def line_of(call: Callable[[], object]) -> str | None:
    """Return the one line with which `call` refuses, None where it succeeds; any other exception passes through."""
    try:
        call()
    except NnhydroError as error:
        return str(error)
    return None


def write_csv(path: Path, columns: Columns, delimiter: str = ",") -> None:
    """Write `columns` to `path`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, delimiter=delimiter)
        writer.writerow(columns)
        writer.writerows(zip(*(["" if np.isnan(x) else repr(float(x)) for x in column] for column in columns.values()), strict=True))


def write_campaign(root: Path, fault: Fault | None = None, runs: int = 2, rows: int = 300) -> Path:
    """Write the healthy campaign, with `fault` in its first run, as a folder; return it."""
    (root / "recordings").mkdir(parents=True, exist_ok=True)
    (root / "arm.yaml").write_text(ARM_YAML, encoding="utf-8")
    for number in range(1, runs + 1):
        columns = healthy(number, rows)
        if fault is not None and number == 1:
            columns = {**columns, **fault(columns)}
        write_csv(root / "recordings" / f"run{number}.csv", columns)
    return root
