"""How long one step takes a controller: C and ONNX, double and single, median and 99th percentile; and 10^7 steps without allocation.

`python training/benchmarks/control_step.py MODEL... ` writes the times of a step to control_step.json, `.. control_step.py loop MODEL...`
the 10^7 steps; MODEL is a folder of a model.
"""

import json
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import onnx
import onnxruntime
from machine import machine

from nnhydro.deployment.files import export_step
from nnhydro.deployment.native import compiler
from nnhydro.models.storage import load_model

STEPS, LOOP = 100_000, 10_000_000
FLAGS = {"O2": ["-O2"], "native": ["-O3", "-march=native"]}  # what users have, and what the machine can do
DRIVER = r"""
#define _POSIX_C_SOURCE 199309L
#include "m.h"
#include <malloc.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
static double took[100000];
static int by_size(const void *a, const void *b) { double x = *(double *)a, y = *(double *)b; return (x > y) - (x < y); }
static double now(void) { struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t); return 1e6*t.tv_sec + 1e-3*t.tv_nsec; }
int main(int count, char **words) {
    long n = atol(words[count - 1]);
    m_state s;
    REAL tau[2], std[2], q[2], qd[2], qdd[2];
    double sum = 0, began = now(), before = (double)mallinfo2().uordblks;
    (void)std;
    m_reset(&s);
    for (long k = 0; k < n; ++k) {
        const double t = 0.002*k;
        for (int j = 0; j < 2; ++j) {
            const double w = 1.7 + 0.6*j, a = 0.8 - 0.3*j;
            q[j] = (REAL)(a*(1 - cos(w*t))); qd[j] = (REAL)(a*w*sin(w*t)); qdd[j] = (REAL)(a*w*w*cos(w*t));
        }
        const double start = now();
        m_step(&s, q, qd, qdd, 0, 0, (REAL)0.002, tau STD);
        if (k < 100000) took[k] = now() - start;
        sum += tau[0];
    }
    const double seconds = 1e-6*(now() - began), after = (double)mallinfo2().uordblks;
    const long m = n < 100000 ? n : 100000;
    qsort(took, m, sizeof(double), by_size);
    printf("{\"steps\": %ld, \"least_us\": %.3f, \"median_us\": %.3f, \"p99_us\": %.3f, ", n, took[0], took[m/2], took[(long)(0.99*m)]);
    printf("\"seconds\": %.2f, \"bytes_allocated\": %.0f, \"sum\": %.6g}\n", seconds, after - before, sum);
    return 0;
}
"""


def in_c(model, precision, steps, flags=tuple(FLAGS)):
    """Return what the driver says of `steps` steps, by the compiler's flags."""
    with TemporaryDirectory() as folder:
        work = Path(folder)
        told = export_step(model, work / "m.h", "c", precision)
        text = DRIVER.replace("REAL", "double" if precision == "double" else "float").replace(" STD", ", std" if told["std"] else "")
        (work / "m.c").write_text(text)
        found = {}
        for name in flags:
            subprocess.run([compiler(), "-std=c99", "-D_DEFAULT_SOURCE", *FLAGS[name], "m.c", "-o", "m", "-lm"], cwd=work, check=True)
            found[name] = json.loads(subprocess.run([str(work / "m"), str(steps)], capture_output=True, text=True, check=True).stdout)
        return found


def in_onnx(model, precision, steps=5000):
    """Return the nodes of a step, and least, median and 99th percentile of one call of onnxruntime on one thread, all bound."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "m.onnx"
        export_step(model, path, "onnx", precision)
        nodes = len(onnx.load(path).graph.node)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    kind = np.float64 if precision == "double" else np.float32
    given = {x.name: np.full(x.shape, 0.1, kind) for x in session.get_inputs()}
    binding, held = session.io_binding(), {name: onnxruntime.OrtValue.ortvalue_from_numpy(x) for name, x in given.items()}
    for name, value in held.items():
        binding.bind_ortvalue_input(name, value)
    for x, value in zip(session.get_outputs(), session.run(None, given), strict=True):
        held[x.name] = onnxruntime.OrtValue.ortvalue_from_numpy(value)
        binding.bind_ortvalue_output(x.name, held[x.name])
    took = []
    for _ in range(steps):
        start = time.perf_counter()
        session.run_with_iobinding(binding)
        took.append(1e6 * (time.perf_counter() - start))
    return {"nodes": nodes, "least_us": min(took), "median_us": float(np.median(took)), "p99_us": float(np.quantile(took, 0.99))}


def main():
    """Measure every model and write control_step.json."""
    path, looped = Path(__file__).with_suffix(".json"), sys.argv[1:2] == ["loop"]
    models = {folder.name: load_model(folder) for folder in map(Path, sys.argv[1 + looped:])}
    before = json.loads(path.read_text()) if path.exists() else {}
    if looped:
        found = before | {"loop": {name: in_c(model, "double", LOOP, ["native"])["native"] for name, model in models.items()}}
        print(json.dumps(found["loop"], indent=1))
    else:
        found = {"machine": machine(), "loop": before.get("loop", {})}
        for name, model in models.items():
            found[name] = {precision: {"c": in_c(model, precision, STEPS), "onnx": in_onnx(model, precision)}
                           for precision in ("double", "single")}
            print(name, json.dumps(found[name], indent=1), flush=True)
    path.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
