"""Writes the data set: python datasets/vortex_tank/make.py [--out DIR] [--only NAME] [--flow]

The strip forces of every motion lie in strips/ as the flow solver made them; `--flow` computes them again (some ten seconds of one core
each), as does a motion whose file is missing, so that a run that was stopped goes on where it was.
"""

from __future__ import annotations

import sys
from pathlib import Path

from truth import strip_forces

sys.path.append(str(Path(__file__).parents[1]))

from strip_tank import Run, Tank, main

FLUID = "{density_kg_m3: 1000.0, kinematic_viscosity_m2_s: 1.0e-6}"
RUNS = [
    Run("slew_slow_both", (-60, -30), ((70, 35),), 0.8),
    Run("slew_mid_both", (50, 20), ((-75, -50),), 1.6),
    Run("slew_fast_both", (-50, 40), ((80, -40),), 3.2),
    Run("slew_mid_link1", (45, -50), ((-80, 0),), 1.6),
    Run("slew_fast_link2", (0, -70), ((0, 130),), 3.5),
    Run("slew_mid_opposed", (30, -50), ((-70, 90),), 2.0),
    Run("reverse_straight_both", (-20, 10), ((40, 20), (-40, -20)), 2.0),
    Run("reverse_straight_link1", (0, -35), ((50, 0), (-50, 0)), 3.0),
    Run("reverse_pause_both", (20, -10), ((-45, 25), (45, -25)), 2.0, 0.5),
    Run("reverse_pause_link2", (-20, 45), ((0, -80), (0, 80)), 3.5, 0.3),
    Run("reverse_thrice", (0, 20), ((25, 14), (-32, -18), (28, 10)), 2.4),
    Run("tow_slew_1", (-40, 10), ((50, -30),), 1.6, tow=0.30),
    Run("tow_slew_2", (-10, -40), ((-45, 80),), 2.4, tow=0.20),
    Run("tow_slew_3", (-40, -30), ((60, 50),), 1.2, tow=0.40),
    Run("fourier_1", (0, 0), multi=28, seconds=6.0),
    Run("fourier_2", (10, -30), multi=35, seconds=6.0),
    Run("fourier_3", (-15, 30), multi=22, seconds=6.0),
    Run("oscillate_kc3", (0, 20), sines=((1, 2.1, 2.6),), seconds=3.0),
    Run("oscillate_kc8", (10, -20), sines=((1, 5.0, 1.1), (2, 3.0, 1.1)), seconds=4.0),
    Run("oscillate_kc20", (-10, 10), sines=((1, 11.0, 0.6),), seconds=5.0),
]
UNSEEN = [
    Run("reach", (-35, 30), ((50, -45), (-30, 40)), 2.2, 0.15, jerk=True),
    Run("fourier_new", (5, 15), multi=30, seconds=6.0),
    Run("tow_reverse", (20, -20), ((-40, 30), (40, -20)), 2.2, tow=0.25),
    Run("oscillate_kc12", (0, 0), sines=((1, 7.0, 0.9), (2, -4.0, 0.9)), seconds=4.0),
]
TANK = Tank(Path(__file__).parent, 1979, FLUID, RUNS, UNSEEN, strip_forces)

if __name__ == "__main__":
    main(TANK, __doc__)
