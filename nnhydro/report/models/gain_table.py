"""The gains on the screen: damping and inertia of each joint at a few of its speeds, model beside baseline and textbook."""

from collections.abc import Sequence

from nnhydro.models.gains.sweeps import Sweep

SHARES = (0.0, 0.25, 0.5, 1.0)  # of the greatest speed


def gain_rows(made: Sequence[Sweep]) -> tuple[list[str], list[list[str]]]:
    """Return the columns and rows of the table, a row a joint and speed."""
    by_speed = [sweep for sweep in made if sweep.over == "speed_rad_s"]
    labels = list(by_speed[0].gains)
    wet = [label for label in labels if label != "dry arm"]
    columns = ["joint", "speed [rad/s]", *(f"damping, {label} [N m s/rad]" for label in wet), *(f"inertia, {x} [kg m²]" for x in labels)]
    rows = []
    for sweep in by_speed:
        middle = (len(sweep.values) - 1) // 2
        for share in SHARES:
            at = middle + round(share * middle)
            rows.append([str(sweep.joint + 1), f"{float(sweep.values[at]):.2f}", *(f"{float(sweep.damping(x)[at]):.4g}" for x in wet),
                         *(f"{float(sweep.inertia(x)[at]):.4g}" for x in labels)])
    return columns, rows


def gain_verdict(made: Sequence[Sweep]) -> str:
    """Return damping and inertia of every joint at half its greatest speed, in one sentence."""
    parts = []
    for sweep in (sweep for sweep in made if sweep.over == "speed_rad_s"):
        middle = (len(sweep.values) - 1) // 2
        at, label = middle + round(0.5 * middle), next(iter(sweep.gains))
        parts.append(f"joint {sweep.joint + 1} is damped by {float(sweep.damping(label)[at]):.3g} N m s/rad and carries "
                     f"{float(sweep.inertia(label)[at]):.3g} kg m²")
    speed = float(made[0].values[-1]) / 2
    return f"At {speed:.3g} rad/s, {'; '.join(parts)}."
