"""Make what ships in the wheel for `nnhydro demo`: `python datasets/make_demo.py` (needs nnhydro installed).

nnhydro/demo/campaign is chosen from datasets/rivera_tank: recordings are copied as they are; of the steady tables every second angle and
speed is kept. nnhydro/demo/concealed is a suite of one campaign that `nnhydro conceal` makes.
"""

import csv
import hashlib
import math
import shutil
import subprocess
import sys
import tempfile
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
CONCEALED = TARGET.parent / "concealed"
HIDE = ("--effect", "coulomb_friction", "--links", "2", "--size", "small", "--seed", "9")
KEY = hashlib.sha256(b"nnhydro/demo/concealed").hexdigest()  # public: the seal keeps the answer from leaking by accident, not from readers
CONCEALED_CARD = """# The concealed campaign of the demo

**Synthetic**, no measurement: made by `nnhydro conceal`, whose truth shares no code with the models and the catalogue. Eight recordings of
a two-link arm, angles and torques alone, in which one effect is hidden. Its name is in answers/campaign_000.sealed, the key in key.txt.
A showcase, no evidence: effect and seed were chosen among four that had been diagnosed, for a finding that is easy to read. How often the
diagnosis is right stands in training/concealed. Made by datasets/make_demo.py. BSD-3-Clause.
"""


def on_grid(angle: float) -> bool:
    """True where `angle` (rad) is a multiple of 30 degrees."""
    return abs(angle / GRID - round(angle / GRID)) < 1e-3


def conceal() -> None:
    """Write the concealed campaign anew."""
    with tempfile.TemporaryDirectory() as folder:
        key, suite = Path(folder) / "key.txt", Path(folder) / "suite"
        key.write_text(KEY + "\n")
        subprocess.run([sys.executable, "-m", "nnhydro", "conceal", "--out", str(suite), *HIDE, "--key", str(key)], check=True)
        shutil.rmtree(CONCEALED, ignore_errors=True)
        shutil.copytree(suite, CONCEALED)
        shutil.copyfile(key, CONCEALED / "key.txt")
    (CONCEALED / "card.md").write_text(CONCEALED_CARD)


def choose() -> None:
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


def main() -> None:
    """Write both campaigns anew."""
    choose()
    conceal()


if __name__ == "__main__":
    main()
