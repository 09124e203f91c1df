"""Models that step through long runs, and their C headers compiled by the C compiler and driven step by step."""

import ctypes
import subprocess
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch
from campaigns import DEFAULT_LAWS, GIVEN, campaign, planted
from rigs import arm
from strip_nets import remembering

from nnhydro.deployment.native import compiler
from nnhydro.effects.hypotheses.coulomb_friction import CoulombFriction
from nnhydro.effects.hypotheses.flow_memory import FlowMemory
from nnhydro.effects.hypotheses.link_interference import LinkInterference
from nnhydro.effects.hypotheses.torque_bias import TorqueBias
from nnhydro.effects.hypotheses.wake_development import WakeDevelopment
from nnhydro.fitting.network.train import train
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion
from nnhydro.physics.travel.state_model import state_loads

FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-fPIC", "-shared")
SAME = {"double": 1e-9, "single": 1e-5}  # of the rms torque
DRIVER = """
int widest = 2; /* 1: as on a processor without AVX-512, 0: without AVX2 */
#define __builtin_cpu_supports(part) (widest > ((part)[3] == '5') && __builtin_cpu_supports(part))
#include "arm.h"
void drive(long n, const real_t *in, real_t *out) {
    arm_state s;
    arm_reset(&s);
    for (long k = 0; k < n; ++k)
        arm_step(&s, in + 9*k, in + 9*k + 2, in + 9*k + 4, in[9*k + 6], in[9*k + 7], in[9*k + 8], out + 2*k STD);
}
"""


def theory(a, loads, instruments=()):
    return StripTheory(a, GIVEN, {}, "physics", loads, tuple(instruments))


def long_run(rows, links=2, dt=2e-3):
    """A run from rest that turns back and stops again and again, as float32 holds it."""
    t = torch.arange(rows, dtype=torch.float64) * dt
    w = torch.tensor([1.7, 2.3][:links], dtype=torch.float64)
    a = torch.tensor([0.8, 0.5][:links], dtype=torch.float64)
    phase = w * t[:, None]
    still = torch.zeros(rows, dtype=torch.float64)
    return Motion(t, a * (1 - torch.cos(phase)), a * w * torch.sin(phase), a * w**2 * torch.cos(phase), still, still)


def under_way(rows=200):
    """A run that begins in the middle of that motion, under tow."""
    run, later = long_run(rows + 150), slice(150, None)
    return Motion(run.t[:rows], run.q[later], run.qd[later], run.qdd[later], run.u0[:rows] + 0.2, run.du0[:rows])


def largest_error(got, want):
    """The largest error of torques (n, 2), of the rms torque; infinite where one is no number."""
    far = np.abs(got - want).max() / np.sqrt((want**2).mean())
    return far if np.isfinite(far) else np.inf


def towed(rows, speed=0.05, dt=2e-3):
    """A slow tow from rest with both joints held: its wake grows by some 1e-5 of itself a step, and on for minutes."""
    t, held = torch.arange(rows, dtype=torch.float64) * dt, torch.zeros(rows, 2, dtype=torch.float64)
    u0 = speed * (t / 0.02).clamp(max=1.0)
    return Motion(t, held + torch.tensor([0.4, 0.3]), held, held, u0, torch.where(t < 0.02, speed / 0.02, 0.0).to(u0))


@cache
def library(header, driver, flags):
    """The library of a header and its driver, compiled once."""
    with TemporaryDirectory() as folder:
        for name, text in (("arm.h", header), ("drive.c", driver)):
            (Path(folder) / name).write_text(text)
        done = subprocess.run([compiler(), *FLAGS, *flags, "drive.c", "-o", "drive.so", "-lm"], cwd=folder, capture_output=True, text=True,
                              check=False)
        assert done.returncode == 0, done.stderr
        return ctypes.CDLL(str(Path(folder) / "drive.so"))


def compiled(folder, precision, std, flags=()):
    """The header in `folder` as a function of a motion that returns its torques (n, 2)."""
    kind, real = (np.float64, "double") if precision == "double" else (np.float32, "float")
    # under -Werror the standard deviation must be asked for where the model has one
    text = DRIVER.replace("real_t", real).replace(" STD", ", std" if std else "").replace("arm_reset(&s);",
                                                                                      f"arm_reset(&s);\n    {real} std[2];" if std else
                                                                                      "arm_reset(&s);")
    loaded = library((folder / "arm.h").read_text(), text, flags)

    def torques(motion, widest=2):
        n = len(motion)
        ctypes.c_int.in_dll(loaded, "widest").value = widest
        dt = torch.diff(motion.t, prepend=motion.t[:1] - 0.7)  # the first one is not read
        columns = [motion.q, motion.qd, motion.qdd, motion.u0[:, None], motion.du0[:, None], dt[:, None]]
        given = np.ascontiguousarray(torch.cat(columns, dim=1).numpy(), kind)
        out = np.zeros((n, 2), kind)
        loaded.drive(ctypes.c_long(n), given.ctypes.data_as(ctypes.c_void_p), out.ctypes.data_as(ctypes.c_void_p))
        return out

    return torques


def driven(folder, motion, precision, std):
    """Torques (n, 2) of the header in `folder` for a motion."""
    return compiled(folder, precision, std)(motion)


MODELS = {
    "constant": lambda a: theory(a, planted(a)),
    "state": lambda a: theory(a, state_loads(a)),
    "diagnosed": lambda a: theory(a, planted(a).plus("rub", CoulombFriction(joint=1, level=(0.3,), bending=(0.05,)))
                                  .plus("lag", FlowMemory(share=(0.5,) * 2, response=(0.2,), travel=(0.3,)))
                                  .plus("grows", WakeDevelopment(*(((0.3 - 0.1 * k,)) for k in range(6)), reach=(8.0,))),
                                  [TorqueBias(joint=1, offset=(0.5,))]),
    "sheltered": lambda a: theory(a, planted(a).plus("lee", LinkInterference((0.3,), (0.2,), (0.1,), (2.0,), (10.0,), joint=1))),
}


@cache
def hybrid(baseline):
    """A hybrid trained for an instant on `baseline`; a network on None."""
    a, kind = arm(2), {"model": "network"} if baseline is None else {"baseline": baseline}
    return train(campaign(a, state_loads(a), 4, seconds=2.0, rate=50.0), DEFAULT_LAWS.model_copy(update=kind))


@cache
def model_of(name):
    """The model called so: of MODELS, a hybrid, one on coefficients over the travel, or one with a net that remembers."""
    learned = {"hybrid": lambda: hybrid("constant"), "with memory": lambda: remembering(hybrid("constant")),
               "with memory on state": lambda: remembering(hybrid("state")), "network with memory": lambda: remembering(hybrid(None))}
    return learned[name]() if name in learned else MODELS[name](arm(2))


@cache
def over(rows, name):
    """A model, a run of so many rows, and the model's torques of it."""
    model, motion = model_of(name), long_run(rows)
    return model, motion, model.torque(motion).numpy()
