"""The `nnhydro` command: finds one command a file in this folder and turns every user's error into one line and exit code 2."""

import errno
import gc
import importlib
import io
import pkgutil
import sys
from collections.abc import Callable
from contextlib import nullcontext
from functools import wraps
from pathlib import Path
from typing import Any, TextIO

import typer

import nnhydro
import nnhydro.cli as folder

EPILOG = "Start with: nnhydro demo. Then: nnhydro check YOUR_CAMPAIGN, nnhydro benchmark YOUR_CAMPAIGN --out DIR."
NOT_COMMANDS = ("main",)
INTERRUPTED = 130  # exit code of Ctrl-C
COLLECTED = 50_000, 20, 50  # new objects before Python looks for unused cycles: a million lasting ones, of imports, are looked through too
REMEDIES = {"ENOSPC": "make room, or name another place", "EDQUOT": "make room, or name another place",
            "EFBIG": "raise the limit on the size of files (ulimit -f)", "EMFILE": "raise the limit on open files (ulimit -n)"}


def _inputs(given: dict[str, Any]) -> list[Path]:
    """What a command reads: every path it is given but --out, and folders of models that are named in texts (--baseline, --models)."""
    found = []
    for value in (value for name, value in given.items() if name != "out"):
        many = value if isinstance(value, list | tuple) else value.split(",") if isinstance(value, str) else [value]
        found += [Path(x) for x in many if isinstance(x, Path) or (isinstance(x, str) and x.strip())]
    return found


def _alone(command: Callable[..., None]) -> Callable[..., None]:
    """The command, run by one process at a time into the same --out, which is none of its inputs."""
    from nnhydro.runtime.lock import only_run
    from nnhydro.runtime.stamp import reading

    @wraps(command)
    def run_alone(**given: Any) -> None:
        """Run the command while no other run writes to its --out."""
        out = given.get("out")
        with reading(_inputs(given)), only_run(out) if isinstance(out, Path) else nullcontext():
            command(**given)
    return run_alone


def build() -> typer.Typer:
    """Return the application; a file `name.py` in this folder with a function `name` is the command `name`."""
    app = typer.Typer(name="nnhydro", help=nnhydro.__doc__, add_completion=False, epilog=EPILOG,
                      pretty_exceptions_enable=False, rich_markup_mode=None)

    @app.callback(invoke_without_command=True)
    def top(context: typer.Context, version: bool = typer.Option(False, "--version", help="Print the version and exit.")) -> None:
        """Print the version where it is asked for, or the help where no command is named; raises typer.Exit after it."""
        if version or context.invoked_subcommand is None:
            typer.echo(nnhydro.__version__ if version else context.get_help())
            raise typer.Exit

    for module in sorted(pkgutil.iter_modules(folder.__path__), key=lambda m: m.name):
        if not module.ispkg and module.name not in NOT_COMMANDS:
            command = importlib.import_module(f"{folder.__name__}.{module.name}")
            app.command(module.name)(_alone(getattr(command, module.name)))
    return app


def _fail(message: str) -> int:
    plain = "".join(letter if letter.isprintable() else "\N{REPLACEMENT CHARACTER}" for letter in " ".join(message.split()))
    typer.echo(f"nnhydro: error: {plain}", err=True)  # no file may send control sequences to the terminal
    return 2


def _say_stopped() -> int:
    typer.echo("nnhydro: stopped; nothing half written was left behind", err=True)
    return INTERRUPTED


def run(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit code: 0, 2 for a user's error, 130 for Ctrl-C."""
    from nnhydro.errors import NnhydroError
    from nnhydro.runtime.user_code import named_faults

    try:
        with named_faults():
            result = build()(args=arguments, standalone_mode=False, prog_name="nnhydro")
    except NnhydroError as error:
        return _fail(str(error))
    except typer.Exit as leave:
        return int(leave.exit_code)
    except (KeyboardInterrupt, typer.Abort):
        return _say_stopped()
    except OSError as error:
        remedy = REMEDIES.get(errno.errorcode.get(error.errno or 0, ""), "check the place and its permissions")
        where = f"{error.filename}: " if error.filename else ""
        return _fail(f"{where}{error.strerror or error}: {remedy}; nothing half written was left behind")
    except MemoryError as error:
        return _fail(f"not enough memory ({error}): split long recordings, or use a machine with more")
    except Exception as error:  # typer's usage errors share no public base class
        if not hasattr(error, "format_message"):
            raise
        return _fail(f"{error.format_message()} (see nnhydro --help)")
    if result == INTERRUPTED:  # typer makes it of Ctrl-C
        return _say_stopped()
    return result if isinstance(result, int) else 0


class _Stream(io.FileIO):
    """A standard stream whose reader may leave (`| head`): what it no longer reads is dropped, and the work goes on."""

    def write(self, data: Any, /) -> int:
        """Write `data`; a reader that is gone is no error."""
        try:
            return super().write(data)
        except BrokenPipeError:
            return len(data)


def _unbreakable(stream: TextIO | None) -> TextIO | None:
    if stream is None:  # closed by whoever called
        return None
    buffer = io.BufferedWriter(_Stream(stream.fileno(), "w", closefd=False))
    return io.TextIOWrapper(buffer, stream.encoding, stream.errors, line_buffering=True)


def main() -> None:
    """Entry point of the `nnhydro` command."""
    gc.set_threshold(*COLLECTED)
    sys.stdout, sys.stderr = _unbreakable(sys.stdout), _unbreakable(sys.stderr)
    code = run()
    try:
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                stream.flush()
    except OSError as error:  # the rest of a table did not fit on the disk
        code, sys.stdout = _fail(f"standard output: {error.strerror}: make room; the results in --out are whole"), None
    sys.exit(code)
