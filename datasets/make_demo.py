"""Choose the small campaign that ships in the wheel (nnhydro/demo/campaign) from datasets/rivera_tank: `python datasets/make_demo.py`.

Recordings are copied as they are; of the steady tables every second angle and speed is kept.
"""

import csv
import math
import shutil
from pathlib import Path

HERE = Path(__file__).parent
SOURCE = HERE / "rivera_tank"
TARGET = HERE.parent / "nnhydro" / "demo" / "campaign"
RECORDINGS = ("fourier1_repeat1", "fourier1_repeat2", "fourier2", "fourier3", "fourier_tow1_repeat1", "fourier_tow2", "fourier_tow3",
              "slew_bang_both", "slew_bang_link1", "slew_jerk_both", "slew_jerk_one", "tow_1_bang", "tow_2_jerk", "tow_3_bang",
              "tow_start_stop_1")
UNSEEN = ("tow_work",)
CARD = """# The demo campaign

Part of datasets/rivera_tank of this project: **synthetic**, computed by an independent program after facts of Rivera (1995) and
McLain & Rock (1998); no measurement. BSD-3-Clause.
"""
GRID = math.radians(30.0)


def on_grid(angle: float) -> bool:
    """True where `angle` (rad) is a multiple of 30 degrees."""
    return abs(angle / GRID - round(angle / GRID)) < 1e-3


def main() -> None:
    """Write the demo campaign anew."""
    shutil.rmtree(TARGET, ignore_errors=True)
    for folder, names in (("recordings", RECORDINGS), ("unseen", UNSEEN)):
        (TARGET / folder).mkdir(parents=True)
        for name in names:
            shutil.copyfile(SOURCE / folder / f"{name}.csv", TARGET / folder / f"{name}.csv")
    (TARGET / "steady").mkdir()
    with (SOURCE / "steady" / "tow_matrix.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    kept = [row for row in rows if on_grid(float(row["q1_rad"])) and on_grid(float(row["q2_rad"])) and float(row["u0_m_s"]) != 0.55]
    with (TARGET / "steady" / "tow_matrix.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(kept)
    shutil.copyfile(SOURCE / "arm.yaml", TARGET / "arm.yaml")
    (TARGET / "card.md").write_text(CARD)


if __name__ == "__main__":
    main()
