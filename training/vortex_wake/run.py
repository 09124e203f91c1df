"""Curves of the discrete-vortex model beside McLain & Rock's; writes results.json and curves.png beside this file."""

import json
import platform
import time
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from matplotlib.figure import Figure

from nnhydro.physics.vortex_wake import WakeChoices, coefficients_across_motions, constant_acceleration, power_start, vortex_coefficients

HERE = Path(__file__).parent


def summary(curve: Any) -> dict[str, float]:
    peak, low = int(curve.C_D.argmax()), int(curve.C_M.argmin())
    numbers = {f"{n}_at_{s:g}": np.interp(s, curve.s_over_D, getattr(curve, n)) for n in ("C_D", "C_M") for s in (3.7, 4.2, 8.0)}
    numbers |= {"C_D_peak": curve.C_D[peak], "C_D_peak_at": curve.s_over_D[peak]}
    numbers |= {"C_M_minimum": curve.C_M[low], "C_M_minimum_at": curve.s_over_D[low]}
    return {name: round(float(value), 4) for name, value in numbers.items()}


def spread(curves: list[Any]) -> dict[str, float]:
    return {name: float(np.ptp([getattr(c, name) for c in curves], axis=0).max()) for name in ("C_D", "C_M")}


def plot(curve: Any, family: Any, published: dict[str, float], path: Path) -> None:
    figure = Figure(figsize=(11, 4.2), layout="constrained")
    drag, inertia = figure.subplots(1, 2)
    for axes, name in ((drag, "C_D"), (inertia, "C_M")):
        axes.plot(curve.s_over_D, getattr(curve, name), label="vortex model, constant acceleration, split by (26), (27)")
        axes.plot(family.s_over_D, getattr(family, name), "--", label="vortex model, fitted over several motions")
        axes.axhline(0.0, color="0.8", lw=0.8)
        axes.set(xlabel="travel s/D [-]", ylabel=f"${name[0]}_{name[2]}$ [-]", xlim=(0, curve.s_over_D[-1]))
    p, measured = published, {"color": "k", "label": "measured, 3-D arm, L/D = 9.2 (McLain & Rock 1998, quoted values)"}
    drag.plot([0, p["C_D_peak_at"], p["C_D_steady_from"]], [0, p["C_D_peak"], p["C_D_steady"]], "o", **measured)
    inertia.plot([0, p["C_M_minimum_at"], p["C_D_steady_from"]], [1, p["C_M_minimum"], p["C_M_steady"]], "o", **measured)
    figure.legend(*drag.get_legend_handles_labels(), loc="outside lower center", fontsize=8)
    figure.savefig(path, dpi=110)


def main() -> None:
    config = tomllib.loads((HERE / "config.toml").read_text())
    choices, D, travel = WakeChoices(**config["choices"]), config["diameter_m"], config["travel"]
    began = time.perf_counter()
    curve = vortex_coefficients(travel, choices, diameter=D)
    wall = time.perf_counter() - began
    family = coefficients_across_motions(tuple(config["exponents"]), travel, choices)
    impulsive = vortex_coefficients(travel, choices, motion=power_start(1.0, 0.0), diameter=D)
    viscous = WakeChoices(**config["choices"], kinematic_viscosity_m2_s=config["kinematic_viscosity_m2_s"])
    motions = [constant_acceleration(a) for a in config["accelerations_m_s2"]]
    varied = {
        json.dumps(change): summary(vortex_coefficients(travel, WakeChoices(**config["choices"] | change))) for change in config["vary"]
    }
    columns = {name: np.round(getattr(curve, name), 5).tolist() for name in ("s_over_D", "C_D", "C_M")}
    results = {
        "seconds_one_curve": round(wall, 2),
        "versions": {"python": platform.python_version(), "numpy": np.__version__, "scipy": scipy.__version__},
        "choices": {name: getattr(choices, name) for name in choices.__dataclass_fields__},
        "constant_acceleration": summary(curve),
        "impulsive_start": summary(impulsive),
        "fitted_over_motions": summary(family) | {"worst_misfit": round(float(family.misfit.max()), 4)},
        "published": config["published"],
        "spread_over_accelerations": spread([vortex_coefficients(travel, choices, motion=m, diameter=D) for m in motions]),
        "spread_over_accelerations_viscous_cores": spread([vortex_coefficients(travel, viscous, motion=m, diameter=D) for m in motions]),
        "one_choice_changed": varied,
        "curve": columns,
        "curve_fitted_over_motions": {name: np.round(getattr(family, name), 5).tolist() for name in ("s_over_D", "C_D", "C_M", "misfit")},
    }
    (HERE / "results.json").write_text(json.dumps(results, indent=1) + "\n")
    plot(curve, family, config["published"], HERE / "curves.png")


if __name__ == "__main__":
    main()
