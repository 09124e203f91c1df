"""A Python that has its libraries loaded and nothing of nnhydro: a command typed with it starts in a fraction of the time.

The `python` in the folder that `warm_python` gives hands its arguments, folder, environment and open files to a server. A fork of that runs
them: a process of its own, which imports nnhydro from where PYTHONPATH says and ends as any Python does.
"""

import contextlib
import gc
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

LIBRARIES = ("numpy", "scipy.interpolate", "scipy.linalg", "scipy.ndimage", "scipy.optimize", "scipy.signal", "scipy.stats", "torch",
             "pandas", "matplotlib.figure", "matplotlib.backends.backend_agg", "pydantic", "typer.testing", "yaml", "rich.table",
             "jinja2", "pydantic.main", "pytest", "scipy.fft", "scipy.integrate")
CLIENT = """#!{python} -IS
import json, os, socket, sys
def is_open(number):
    try:
        os.fstat(number)
        return True
    except OSError:
        return False
files = [number for number in range(3) if is_open(number)]
with socket.socket(socket.AF_UNIX) as server:
    server.connect({path!r})
    text = json.dumps([sys.argv[1:], os.getcwd(), dict(os.environ), files]).encode()
    socket.send_fds(server, [len(text).to_bytes(8, "big")], files)
    server.sendall(text)
    code = server.recv(8)
sys.exit(int(code or b"70"))
"""


@contextlib.contextmanager
def warm_python() -> Iterator[Path]:
    """Give the folder of such a `python` while its server runs."""
    with TemporaryDirectory() as folder:
        path, client = Path(folder) / "server", Path(folder) / "python"
        client.write_text(CLIENT.format(python=sys.executable, path=str(path)))
        client.chmod(0o755)
        alone = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | {"OMP_NUM_THREADS": "1"}
        command = [sys.executable, "-P", __file__, str(path)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=alone) as server:
            assert server.stdout is not None
            assert server.stdout.readline() == b"ready\n"
            yield Path(folder)  # it ends with its standard input, whatever becomes of this process


def _received(connection: socket.socket) -> tuple[list[str], str, dict[str, str], dict[int, int]]:
    """Arguments, folder, environment, and for each open file of the caller its number there and here."""
    size, files, _, _ = socket.recv_fds(connection, 8, 3)
    text = b""
    while len(text) < int.from_bytes(size, "big"):
        text += connection.recv(65536)
    arguments, folder, environment, numbers = json.loads(text)
    return arguments, folder, environment, dict(zip(numbers, files, strict=True))


def _serve(path: str) -> list[str]:
    """Fork for every caller; returns, in the fork alone, the arguments to run, everything else as it is at the caller's."""
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(path)
        server.listen()
        print("ready", flush=True)
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)
        while sys.stdin not in select.select([server, sys.stdin], [], [])[0]:
            connection, _ = server.accept()
            if os.fork():
                connection.close()
                continue
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            server.close()
            arguments, folder, environment, files = _received(connection)
            child = os.fork()
            if child:
                code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
                connection.sendall(str(code if code >= 0 else 128 - code).encode())
                os._exit(0)
            connection.close()
            _take_over(folder, environment, files)
            return arguments
    sys.exit()


def _take_over(folder: str, environment: dict[str, str], files: dict[int, int]) -> None:
    """Stand in the caller's folder with its environment and its open files."""
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if number in files:
            os.dup2(files[number], number)
        else:
            os.close(number)
            setattr(sys, name, None)
    for here in files.values():
        os.close(here)


if __name__ == "__main__":
    for library in LIBRARIES:
        import_module(library)
    gc.freeze()
    kind, what, *others = _serve(sys.argv[1])
    sys.path[:0] = [os.getcwd() if kind == "-m" else "", *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
    sys.argv = [kind, *others]
    if kind == "-m":
        runpy.run_module(what, run_name="__main__", alter_sys=True)
    else:
        exec(compile(what, "<string>", "exec"), {"__name__": "__main__"})
