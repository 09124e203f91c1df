"""What it costs to hand a task to a worker: `python training/benchmarks/handing_out.py`.

Two processes of this machine (joblib) and two workers of a dask cluster on it: wall time until the first result, which is the start of
interpreters and the import of torch, and then per task; a fit takes seconds, a diagnosis half a minute. Needs nnhydro[cluster]. A minute.
"""

import time
from pathlib import Path

from machine import machine, versions

from nnhydro.runtime.files import write_json
from nnhydro.runtime.workers import Workers, spread

TASKS = 400


def trivial(number: int) -> tuple[int, float]:
    """Import what a diagnosis needs, and do nothing; return the number and the worker's largest memory so far, MB."""
    import resource

    import nnhydro.diagnosis.diagnose  # noqa: F401

    return number, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def measured(workers: Workers) -> dict[str, float]:
    """Return seconds until the first result and milliseconds for each further one."""
    began = time.perf_counter()
    results = spread(trivial, [(k,) for k in range(TASKS)], workers)
    next(results)
    first = time.perf_counter() - began
    rest = list(results)
    assert [number for number, _ in rest] == list(range(1, TASKS))
    return {"first_s": first, "task_ms": 1e3 * (time.perf_counter() - began - first) / (TASKS - 1), "memory_mb": max(mb for _, mb in rest)}


def main() -> None:
    """Print and store the costs."""
    from distributed import LocalCluster

    found = {"two processes (--jobs 2)": measured(Workers(jobs=2))}
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        found["dask, two workers"] = measured(Workers(backend="dask", scheduler=cluster.scheduler_address))
    for name, cost in found.items():
        print(f"{name:28s} first result after {cost['first_s']:5.1f} s, then {cost['task_ms']:6.2f} ms a task; "
              f"{cost['memory_mb']:.0f} MB per worker before any data")
    print(machine("joblib", "distributed"))
    write_json(Path(__file__).with_suffix(".json"), {"costs": found, "machine": machine(), "versions": versions("joblib", "distributed")})


if __name__ == "__main__":
    main()
