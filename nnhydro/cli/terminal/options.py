"""The options of commands whose work can be shared out: --jobs, --backend, --scheduler (runtime/workers.py, docs/cluster.md)."""

import typer

JOBS = typer.Option(1, "--jobs", help="Processes of this machine that share the work; -1: one a core.")
BACKEND = typer.Option("processes", "--backend", help="processes, or dask: the workers of the cluster at --scheduler.")
SCHEDULER = typer.Option("", "--scheduler", help="Address of a dask scheduler, such as tcp://head:8786.")
