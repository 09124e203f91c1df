"""A program of scalars compiled by the system's C compiler, to be called with numpy arrays."""

import ctypes
import subprocess

import numpy as np

from nnhydro.deployment.c_program import c_function
from nnhydro.deployment.native import compiler

REAL = {"double": np.float64, "single": np.float32}


def in_c(folder, program, outputs, precision="double", flags=()):
    """A program as a function from an array to an array."""
    without_vectors = "#ifdef ANY_COMPILER\n#undef __GNUC__\n#endif\n"
    (folder / "p.c").write_text(f"#include <math.h>\n{without_vectors}{c_function('void run', program, outputs, precision)}")
    library = folder / f"{precision}{len(flags)}.so"
    command = [compiler(), "-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", *flags, "-fPIC", "-shared", "p.c", "-o", library, "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    loaded = ctypes.CDLL(str(library))

    def run(x):
        given, out = np.ascontiguousarray(x, REAL[precision]), np.zeros(len(outputs), REAL[precision])
        loaded.run(given.ctypes.data_as(ctypes.c_void_p), out.ctypes.data_as(ctypes.c_void_p))
        return out

    return run
