"""The `nnhydro` command: finds one command a file in this folder and turns every user's error into one line and exit code 2."""

import importlib
import pkgutil
import sys

import typer

import nnhydro
import nnhydro.cli as folder

EPILOG = "Start with: nnhydro demo. Then: nnhydro check YOUR_CAMPAIGN, nnhydro benchmark YOUR_CAMPAIGN --out DIR."
NOT_COMMANDS = ("main",)


def build() -> typer.Typer:
    """Return the application; a file `name.py` in this folder with a function `name` is the command `name`."""
    app = typer.Typer(name="nnhydro", help=nnhydro.__doc__, no_args_is_help=True, add_completion=False, epilog=EPILOG,
                      pretty_exceptions_enable=False, rich_markup_mode=None)

    @app.callback(invoke_without_command=True)
    def top(version: bool = typer.Option(False, "--version", help="Print the version and exit.")) -> None:
        if version:
            typer.echo(nnhydro.__version__)
            raise typer.Exit

    for module in sorted(pkgutil.iter_modules(folder.__path__), key=lambda m: m.name):
        if module.name not in NOT_COMMANDS:
            command = importlib.import_module(f"{folder.__name__}.{module.name}")
            app.command(module.name)(getattr(command, module.name))
    return app


def _fail(message: str) -> int:
    typer.echo(f"nnhydro: error: {' '.join(message.split())}", err=True)
    return 2


def run(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit code: 0, 2 for a user's error, 130 for Ctrl-C."""
    from nnhydro.errors import NnhydroError

    try:
        result = build()(args=arguments, standalone_mode=False, prog_name="nnhydro")
    except NnhydroError as error:
        return _fail(str(error))
    except typer.Exit as leave:
        return int(leave.exit_code)
    except (KeyboardInterrupt, typer.Abort):
        typer.echo("nnhydro: interrupted; nothing half written was left behind", err=True)
        return 130
    except BrokenPipeError:
        sys.stderr.close()
        return 0
    except Exception as error:  # typer's usage errors share no public base class
        if not hasattr(error, "format_message"):
            raise
        return _fail(f"{error.format_message()} (see nnhydro --help)")
    return result if isinstance(result, int) else 0


def main() -> None:
    """Entry point of the `nnhydro` command."""
    sys.exit(run())
