"""Writes the data set: python datasets/concealed/make.py [--out DIR]   (under a minute; needs nnhydro installed)"""

import argparse
import hashlib
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))

from card_file import write_card

HERE = Path(__file__).parent
SEED = 20261
KEY = hashlib.sha256(b"datasets/concealed").hexdigest()  # public: the seal keeps answers from leaking by accident, not from readers
HIDDEN = ("wake_development", "reynolds_drag", "link_interference", "ambient_current", "rotor_inertia", "coulomb_friction",
          "viscous_friction", "umbilical_stiffness", "joint_elasticity", "torque_drift", "sensor_timing", "encoder_offset",
          "none", "none", "none")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=HERE)
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        key, made = Path(folder) / "key.txt", Path(folder) / "suite"
        key.write_text(KEY + "\n")
        subprocess.run([sys.executable, "-m", "nnhydro", "conceal", "--out", str(made), "--effect", ",".join(HIDDEN),
                        "--strength", "strong", "--size", "small", "--seed", str(SEED), "--key", str(key)], check=True)
        for old in out.glob("campaign_*"):
            shutil.rmtree(old)
        shutil.copytree(made, out, dirs_exist_ok=True)
        shutil.copy(key, out / "key.txt")
    files = sorted(p for p in out.rglob("*") if p.is_file() and p.suffix in (".csv", ".yaml", ".sealed", ".json"))
    write_card(HERE, out, SEED, files, ())


if __name__ == "__main__":
    main()
