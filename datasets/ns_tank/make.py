"""Writes the data set: python datasets/ns_tank/make.py [--out DIR] [--only NAME] [--flow]

The strip forces of every motion lie in strips/ as the flow solver made them; `--flow` computes them again (about a minute of one core
each), as does a motion whose file is missing, so that a run that was stopped goes on where it was.
"""

from __future__ import annotations

import sys
from pathlib import Path

from truth import strip_forces

sys.path.append(str(Path(__file__).parents[1]))

from strip_tank import Run, Tank, main

FLUID = "{density_kg_m3: 1190.0, kinematic_viscosity_m2_s: 2.4e-5}   # water with 73 % glycerine"
RUNS = [
    Run("slew_slow_both", (-40, -30), ((44, 28),), 0.35),
    Run("slew_mid_both", (35, 20), ((-38, -30),), 0.6),
    Run("slew_fast_both", (-30, 40), ((45, -30),), 1.4),
    Run("slew_mid_link1", (30, -50), ((-48, 0),), 0.7),
    Run("slew_fast_link2", (0, -45), ((0, 90),), 1.6),
    Run("slew_mid_opposed", (20, -30), ((-50, 60),), 1.0),
    Run("reverse_straight_both", (-10, 10), ((22, 12), (-22, -12)), 0.8),
    Run("reverse_straight_link1", (0, -35), ((30, 0), (-30, 0)), 1.2),
    Run("reverse_pause_both", (10, -10), ((-25, 15), (25, -15)), 0.9, 0.5),
    Run("reverse_pause_link2", (-20, 30), ((0, -50), (0, 50)), 1.6, 0.3),
    Run("reverse_thrice", (0, 20), ((14, 8), (-18, -10), (16, 6)), 1.0),
    Run("tow_slew_1", (-30, 10), ((25, -20),), 0.7, tow=0.12),
    Run("tow_slew_2", (-10, -40), ((-35, 70),), 1.1, tow=0.10),
    Run("tow_slew_3", (-20, -30), ((25, 20),), 0.5, tow=0.12),
    Run("fourier_1", (0, 0), multi=13, seconds=5.0),
    Run("fourier_2", (10, -30), multi=14, seconds=5.0),
    Run("fourier_3", (-15, 30), multi=9, seconds=5.0),
    Run("oscillate_kc3", (0, 20), sines=((1, 2.1, 1.6),), seconds=3.4),
    Run("oscillate_kc8", (10, -20), sines=((1, 5.0, 0.55), (2, 3.0, 0.55)), seconds=4.6),
    Run("oscillate_kc20", (-10, 10), sines=((1, 11.0, 0.26),), seconds=5.0),
]
UNSEEN = [
    Run("reach", (-25, 30), ((30, -35), (-18, 30)), 0.9, 0.15, jerk=True),
    Run("fourier_new", (5, 15), multi=16, seconds=5.0),
    Run("tow_reverse", (10, -20), ((-22, 20), (22, -10)), 0.9, tow=0.10),
    Run("oscillate_kc12", (0, 0), sines=((1, 7.0, 0.42), (2, -4.0, 0.42)), seconds=5.0),
]
TANK = Tank(Path(__file__).parent, 1966, FLUID, RUNS, UNSEEN, strip_forces)

if __name__ == "__main__":
    main(TANK, __doc__)
