"""Long jobs spread over processes or a cluster: the same numbers in the same order, and nothing lost with a worker."""

import os
import platform
import shutil
import signal
import subprocess
import sys
import time
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from nnhydro.cli.main import build
from nnhydro.errors import ConfigError, MissingExtraError, RecordingError
from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.splitting import units
from nnhydro.recordings.survey import survey
from nnhydro.runtime.workers import WorkerError, Workers, spread

DEMO = Path(__file__).parents[3] / "nnhydro" / "demo" / "campaign"
TWO = Workers(jobs=2)
MODELS = ["constant", "textbook", "rigid"]


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    """The folder of the shipped campaign with five of its recordings."""
    folder = tmp_path_factory.mktemp("few") / "campaign"
    shutil.copytree(DEMO, folder, ignore=shutil.ignore_patterns("slew*", "tow_*", "unseen", "steady"))
    return folder


def squared(x, seconds=0.0):
    time.sleep(seconds)
    return x * x, os.getpid()


def failing(x):
    raise RecordingError(f"recording {x} is not readable")


def ending_its_process(x):
    os.kill(os.getpid(), signal.SIGKILL)


def names_here(folder):
    return sorted(path.name for path in Path(folder).iterdir())


def without_times(document):
    return {**document, "models": {name: {k: v for k, v in entry.items() if k != "fit_s"} for name, entry in document["models"].items()}}


@cache
def compared(folder, workers):
    result = BenchmarkOptions(MODELS, 3).benchmark(open_campaign(folder), workers=workers)
    return without_times(result.document())


def test_alone_tasks_are_done_here_in_order():
    assert [(x, pid == os.getpid()) for x, pid in spread(squared, [(k,) for k in range(4)])] == [(0, True), (1, True), (4, True), (9, True)]


@pytest.mark.parametrize(("choices", "said"), [
    ({"backend": "spark"}, "--backend 'spark': one of processes, dask"), ({"jobs": 0}, "--jobs 0"),
    ({"backend": "dask"}, "needs --scheduler"),
    ({"scheduler": "tcp://head:8786"}, "goes with --backend dask"),
    ({"backend": "dask", "scheduler": "tcp://head:8786", "jobs": 2}, "goes with --backend processes")])
def test_workers_that_cannot_be_are_refused(choices, said):
    with pytest.raises(ConfigError, match=said):
        Workers(**choices)


def test_without_distributed_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'nnhydro\[cluster\]'"):
        list(spread(squared, [(1,)], Workers(backend="dask", scheduler="tcp://127.0.0.1:1")))


def test_a_campaign_and_its_units_go_to_another_process_without_what_was_read():
    import pickle

    campaign = open_campaign(DEMO)
    how = campaign.plan()
    every = units(campaign, how)
    assert every[0].segments()
    sent = pickle.dumps(every)
    assert len(sent) < 200_000
    again = pickle.loads(sent)
    assert [unit.name for unit in again] == [unit.name for unit in every]
    np.testing.assert_array_equal(again[0].segments()[0].q, every[0].segments()[0].q)


@pytest.mark.slow
def test_processes_give_the_results_in_order_and_pass_errors_on():
    found = list(spread(squared, [(k, 0.2 if k == 0 else 0.0) for k in range(8)], TWO))
    assert [x for x, _ in found] == [k * k for k in range(8)]
    assert os.getpid() not in {pid for _, pid in found}
    with pytest.raises(RecordingError, match="recording 3 is not readable"):
        list(spread(failing, [(3,)], TWO))


@pytest.mark.slow
def test_a_worker_that_has_grown_is_replaced_without_a_word(tmp_path):
    """joblib ends workers that have grown by 300 MB; its warning, raised as an error, once ended the thread that collects results."""
    (tmp_path / "growing.py").write_text("""
import time
KEPT = []
def small(x):
    return x
def large(x):
    KEPT.append(bytearray(400_000_000) if x == 0 else b"")
    time.sleep(2.0 if x == 0 else 0.0)
    return x
""")
    (tmp_path / "main.py").write_text("""
import time
from growing import large, small
from nnhydro.runtime.workers import Workers, spread
two = Workers(2)
list(spread(small, [(k,) for k in range(8)], two))
time.sleep(1.5)
list(spread(small, [(k,) for k in range(8)], two))
print(list(spread(large, [(k % 2,) for k in range(8)], two)))
""")
    paths = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(Path(__file__).parents[3])])}
    done = subprocess.run([sys.executable, "-W", "error::UserWarning", "main.py"], cwd=tmp_path, capture_output=True, text=True,
                          timeout=100, env=paths, check=False)
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, "[0, 1, 0, 1, 0, 1, 0, 1]", "")


@pytest.mark.slow
def test_benchmark_and_check_say_the_same_whoever_works(few):
    assert compared(few, TWO) == compared(few, Workers())
    campaign = open_campaign(few)
    assert survey(campaign, workers=TWO) == survey(campaign)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # loky warns that a worker stopped, which is the point
def test_a_process_that_the_system_ends_is_told_in_one_line():  # after the others, which work in the same processes
    with pytest.raises(WorkerError, match=r"ended from outside .* fewer --jobs"):
        list(spread(ending_its_process, [(1,), (2,)], TWO))


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as made:
        yield made


def kill_one(cluster):
    """End a worker process as the system would."""
    os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # distributed's own, when workers come and go
def test_a_worker_killed_in_mid_run_loses_nothing(cluster, tmp_path, monkeypatch):
    there = Workers(backend="dask", scheduler=cluster.scheduler_address)
    found = []
    for x, _ in spread(squared, [(k, 0.3) for k in range(12)], there):
        found.append(x)
        if len(found) == 3:
            kill_one(cluster)
    assert found == [k * k for k in range(12)]
    monkeypatch.chdir(DEMO)
    assert next(spread(names_here, [("recordings",)], there)) == names_here(DEMO / "recordings")  # relative paths, too


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_benchmark_whose_worker_is_killed_gives_the_same_numbers(cluster, few):
    there = Workers(backend="dask", scheduler=cluster.scheduler_address)
    told = []

    def report(label):
        told.append(label)
        if len(told) == 2:
            kill_one(cluster)

    result = BenchmarkOptions(MODELS, 3).benchmark(open_campaign(few), report, workers=there)
    assert without_times(result.document()) == compared(few, Workers())
    assert len(told) == 9


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_scheduler_that_does_not_answer_is_told(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("nnhydro.runtime.workers.PATIENCE", 1)
    with pytest.raises(ConfigError, match="no dask scheduler answers there"):
        list(spread(squared, [(1,)], Workers(backend="dask", scheduler="tcp://127.0.0.1:9")))


def test_the_commands_take_workers_and_refuse_those_that_cannot_be():
    from nnhydro.cli.main import run

    assert run(["check", str(DEMO), "--jobs", "0"]) == 2
    assert run(["benchmark", str(DEMO), "--out", "unused", "--backend", "dask"]) == 2
    for command in ("check", "benchmark", "diagnose"):
        text = CliRunner().invoke(build(), [command, "--help"]).output
        assert all(option in text for option in ("--jobs", "--backend", "--scheduler")), command


@pytest.mark.skipif(not sys.platform.startswith("linux") or platform.libc_ver()[0] != "glibc", reason="a setting of glibc")
def test_memory_that_is_freed_is_kept_for_the_next_step():
    """Twenty blocks of 3 MB, made and freed again and again: their pages are fetched from the system once instead of every time."""
    script = ("import resource, sys, numpy\nfrom nnhydro.runtime.workers import keep_freed_memory\n"
              "assert sys.argv[1] == 'no' or keep_freed_memory()\n"
              "for _ in range(10):\n    [numpy.ones(3_000_000, numpy.uint8) for _ in range(20)]\n"
              "print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt)")
    kept, returned = (int(subprocess.run([sys.executable, "-c", script, how], capture_output=True, text=True, check=True).stdout)
                      for how in ("yes", "no"))
    assert kept < returned / 2
