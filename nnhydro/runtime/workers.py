"""Long jobs spread over processes of this machine, or over a cluster: the same functions, the same numbers.

    for result in spread(function, tasks, Workers(jobs=4)): ...                                 # four processes here
    for result in spread(function, tasks, Workers(backend="dask", scheduler="tcp://head:8786")): ...

Results come in the order of the tasks, however they were worked off. Tasks are told, not data: a worker reads the recordings it needs from
their files, so that what one worker has read is not lost with it, and a task whose worker dies is given to another. See docs/cluster.md.
"""

import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import chdir, contextmanager
from dataclasses import dataclass
from typing import Any, Final, TypeVar, final

from nnhydro.errors import ConfigError, NnhydroError, missing_extra, require

Result = TypeVar("Result")
BACKENDS: Final = ("processes", "dask")
PATIENCE: Final = 30  # s: a scheduler that has not answered by then is not there
MALLOC: Final = ((-3, 2**30), (-1, 2**31 - 1), (-2, 2**26))  # glibc's malloc.h: M_MMAP_THRESHOLD, M_TRIM_THRESHOLD, M_TOP_PAD; bytes
RENEWED: Final = "A worker stopped while some jobs were given to the executor"  # one that grew by 300 MB: another takes its place


class WorkerError(NnhydroError):
    """Workers died again and again on the same task."""


@final
@dataclass(frozen=True)
class Workers:
    """Who works: `jobs` processes of this machine (-1: one per core), or all workers of the dask scheduler at the address `scheduler`."""

    jobs: int = 1
    backend: str = "processes"
    scheduler: str = ""

    def __post_init__(self) -> None:
        require(self.backend in BACKENDS, f"--backend {self.backend!r}: one of {', '.join(BACKENDS)}")
        require(self.jobs >= 1 or self.jobs == -1, f"--jobs {self.jobs}: give a number of processes, or -1 for one per core")
        require(self.backend == "dask" or not self.scheduler, f"--scheduler {self.scheduler}: goes with --backend dask")
        require(self.backend != "dask" or bool(self.scheduler),
                "--backend dask: needs --scheduler ADDRESS, which `dask scheduler` prints when it starts (tcp://HOST:8786)")
        require(self.backend != "dask" or self.jobs == 1, "--jobs: goes with --backend processes only: a dask cluster has its own size")

    @property
    def alone(self) -> bool:
        """Whether this process works alone."""
        return self.backend == "processes" and self.jobs == 1


HERE: Final = Workers()  # this process alone


def keep_freed_memory() -> bool:
    """Keep memory that is freed for later use, up to 2 GB, instead of returning it to the system after every step; whether this was done.

    A training allocates and frees the same megabytes thousands of times: a tenth of its time went to the system. It is for programs of
    their own, as commands are, and works where the C library is glibc.
    """
    import ctypes

    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if os.name == "posix" else None
    return mallopt is not None and all(mallopt(*setting) == 1 for setting in MALLOC)


def _call(task: tuple[Callable[..., Result], tuple[Any, ...], str]) -> Result:
    """One task, as one argument: joblib hands large arguments of their own to one worker, and they would be lost with it.

    It is done in the folder from which it was sent, so that relative paths mean the same on every machine that shares it.
    """
    function, arguments, folder = task
    with chdir(folder):
        return function(*arguments)


@contextmanager
def _dask(workers: Workers) -> Iterator[None]:
    """joblib's tasks go to the scheduler inside the block."""
    try:
        import distributed
    except ImportError:
        missing_extra("distributed", "cluster", "--backend dask")
    import joblib

    connect: Any = distributed.Client  # its own hints are partial
    try:
        client = connect(workers.scheduler, timeout=PATIENCE)
    except (OSError, TimeoutError, ValueError) as cause:
        raise ConfigError(f"--scheduler {workers.scheduler}: no dask scheduler answers there ({cause}): start one with `dask scheduler`, "
                          "workers with `dask worker ADDRESS --nthreads 1`") from cause
    with client, joblib.parallel_config(backend="dask", client=client, wait_for_workers_timeout=PATIENCE):
        yield


def _results(function: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], jobs: int | None) -> Iterator[Result]:
    """Results in the order of the tasks, as they come in from joblib."""
    import joblib

    warnings.filterwarnings("ignore", message=RENEWED, category=UserWarning)  # raised as an error it would end the thread that waits
    parallel = joblib.Parallel(n_jobs=jobs, return_as="generator", pre_dispatch="all")
    yield from parallel(joblib.delayed(_call)((function, task, os.getcwd())) for task in tasks)


def spread(function: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], workers: Workers = HERE) -> Iterator[Result]:
    """Yield function(*task) for every task, in order.

    Raises what `function` raises, MissingExtraError without the library distributed, ConfigError where no scheduler answers, WorkerError
    where the system ended the workers.
    """
    if workers.alone:
        yield from (function(*task) for task in tasks)
        return
    if workers.backend == "dask":
        with _dask(workers):
            yield from _watch(function, tasks, None)
        return
    yield from _watch(function, tasks, workers.jobs)


def _watch(function: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], jobs: int | None) -> Iterator[Result]:
    """The results; what tells that workers died says so in one line."""
    try:
        yield from _results(function, tasks, jobs)
    except Exception as cause:
        if type(cause).__name__ not in ("KilledWorker", "TerminatedWorkerError", "BrokenProcessPool"):
            raise
        raise WorkerError(f"a worker was ended from outside ({type(cause).__name__}), mostly for want of memory: use fewer --jobs, or "
                          "workers with more memory; finished results that were written are kept") from cause
