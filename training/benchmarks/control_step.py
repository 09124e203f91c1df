"""How long one step takes a controller: C and ONNX, double and single, median and 99th percentile; and 10^7 steps without allocation.

`python training/benchmarks/control_step.py MODEL... ` writes the times of a step to control_step.json, `.. control_step.py loop MODEL...`
the 10^7 steps, `.. control_step.py onnx MODEL...` those of onnxruntime alone, `.. control_step.py rounds MODEL...` what onnxruntime cannot
go below: rounds of operations that wait for one another, and the time of these operations on vectors that lie ready, beside the whole step;
MODEL is a folder of a model.
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
from nnhydro.deployment.onnx.clipping import with_clips
from nnhydro.deployment.onnx.onnx_graph import Graph
from nnhydro.deployment.onnx.schedule import rounds
from nnhydro.deployment.step import record_step
from nnhydro.models.storage import load_model

STEPS, LOOP = 100_000, 10_000_000
KINDS = {"double": np.float64, "single": np.float32}
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


def bound(model_bytes, kind):
    """Return a call of the model in onnxruntime on one thread, with inputs and outputs bound, and what must stay in memory for it."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(model_bytes, options, providers=["CPUExecutionProvider"])
    given = {x.name: np.full(x.shape, 0.1, kind) for x in session.get_inputs()}
    binding, held = session.io_binding(), {name: onnxruntime.OrtValue.ortvalue_from_numpy(x) for name, x in given.items()}
    for name, value in held.items():
        binding.bind_ortvalue_input(name, value)
    for x, value in zip(session.get_outputs(), session.run(None, given), strict=True):
        held[x.name] = onnxruntime.OrtValue.ortvalue_from_numpy(value)
        binding.bind_ortvalue_output(x.name, held[x.name])
    return lambda: session.run_with_iobinding(binding), held


def microseconds(call, steps=5000):
    """Return least, median and 99th percentile of one call."""
    took = []
    for _ in range(steps):
        start = time.perf_counter()
        call()
        took.append(1e6 * (time.perf_counter() - start))
    return {"least_us": min(took), "median_us": float(np.median(took)), "p99_us": float(np.quantile(took, 0.99))}


def in_onnx(model, precision):
    """Return the nodes of a step, and least, median and 99th percentile of one call of onnxruntime on one thread, all bound."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "m.onnx"
        export_step(model, path, "onnx", precision)
        call, _held = bound(path.read_bytes(), KINDS[precision])
        return {"nodes": len(onnx.load(path).graph.node), **microseconds(call)}


def operations_alone(recorded, precision):
    """Return the rounds of a step, and nodes and times of its operations alone: no sum, no network, no value led to where it is needed."""
    program, flat = with_clips(recorded.program, [x for values in recorded.outputs.values() for x in values.ravel()])
    planned, graph, helper = rounds(program, flat), Graph(KINDS[precision]), onnx.helper
    number, sizes, made = helper.np_dtype_to_tensor_dtype(graph.dtype), set(), []
    for kind, atoms in ((kind, atoms) for kinds in planned for kind, atoms in kinds.items() if kind not in ("maxof", "minof")):
        sizes.add(len(atoms))
        made.append(graph.operation(kind, [f"x{len(atoms)}"] * len(program.atoms[atoms[0]].operands)))
    given = [helper.make_tensor_value_info(f"x{size}", number, [size]) for size in sizes]
    whole = helper.make_graph(graph.nodes, "operations", given, [helper.make_tensor_value_info(name, number, None) for name in made],
                              list(graph.constants.values()))
    call, _held = bound(helper.make_model(whole, opset_imports=[helper.make_opsetid("", 18)], ir_version=10).SerializeToString(),
                        KINDS[precision])
    return {"rounds": len(planned), "nodes": len(graph.nodes), **microseconds(call)}


def main():
    """Measure every model and write control_step.json."""
    path, mode = Path(__file__).with_suffix(".json"), sys.argv[1] if sys.argv[1:2] in (["loop"], ["onnx"], ["rounds"]) else ""
    models = {folder.name: load_model(folder) for folder in map(Path, sys.argv[1 + bool(mode):])}
    before = json.loads(path.read_text()) if path.exists() else {}
    if mode == "loop":
        found = before | {"loop": {name: in_c(model, "double", LOOP, ["native"])["native"] for name, model in models.items()}}
        print(json.dumps(found["loop"], indent=1))
    elif mode == "onnx":
        made = {name: {precision: in_onnx(model, precision) for precision in KINDS} for name, model in models.items()}
        found = before | {"onnx": {"machine": machine("onnxruntime"), **made}}
        print(json.dumps(found["onnx"], indent=1))
    elif mode == "rounds":
        made = {name: {precision: {"operations alone": operations_alone(record_step(model), precision), "step": in_onnx(model, precision)}
                       for precision in KINDS} for name, model in models.items()}
        found = before | {"rounds": {"machine": machine("onnxruntime"), **made}}
        print(json.dumps(found["rounds"], indent=1))
    else:
        found = {"machine": machine(), **{key: before[key] for key in ("loop", "onnx", "rounds") if key in before}}
        for name, model in models.items():
            found[name] = {precision: {"c": in_c(model, precision, STEPS), "onnx": in_onnx(model, precision)} for precision in KINDS}
            print(name, json.dumps(found[name], indent=1), flush=True)
    path.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
