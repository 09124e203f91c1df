"""How far a training is: on a terminal a bar with the time left, elsewhere a line every twentieth of the way; and a log for TensorBoard."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from nnhydro.cli.terminal.output import note, quiet
from nnhydro.errors import missing_extra

OnEpoch = Callable[[int, int, float], None]  # epoch, epochs, validation error in units of the rms torque to be learned
OF = "of the rms torque to be learned"
LINES = 20  # where there is no terminal


def _lines() -> OnEpoch:
    """A line now and then, with the time that the rest would take at the pace so far."""
    began: list[tuple[float, int]] = []

    def report(epoch: int, epochs: int, error: float) -> None:
        """Print a line where one is due."""
        began.append((time.monotonic(), epoch))
        if epoch % max(1, epochs // LINES) == 0:
            (start, first), (now, _) = began[0], began[-1]
            pace = (now - start) / (epoch - first) if epoch > first else None
            left = "" if pace is None or epoch == epochs else f", {pace * (epochs - epoch):.0f} s left at most"
            note(f"epoch {epoch}/{epochs}: validation error {100 * error:.3g} % {OF}{left}")

    return report


@contextmanager
def epochs_on_screen() -> Iterator[OnEpoch]:
    """Yield what to call after each epoch; writes to standard error. Early stopping may end a training before the time left is over."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    console = Console(stderr=True)
    if not console.is_terminal or quiet():
        yield _lines()
        return
    columns = (TextColumn("epoch {task.completed}/{task.total}"), BarColumn(),
               TextColumn(f"validation error {{task.fields[error]:.3g}} % {OF}"), TimeElapsedColumn(), TextColumn("left at most"),
               TimeRemainingColumn())
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("training", total=None, error=float("nan"))
        yield lambda epoch, epochs, error: bar.update(task, completed=epoch, total=epochs, error=100 * error)


def time_left(began: float, done: int, total: int | None) -> str:
    """Return how long the rest takes at the pace so far, as text; nothing where there is no pace yet."""
    if not done or total is None or done >= total:
        return ""
    return f" (about {(time.monotonic() - began) / done * (total - done):.0f} s left)"


@contextmanager
def steps_on_screen(total: int | None = None) -> Iterator[Callable[[str], None]]:
    """Yield what to call with the name of each step as it begins (`name, detail` for news of a step under way); to standard error.

    On a terminal one line that changes, elsewhere one line per step; with `total` the remaining time is shown once the pace is known.
    """
    from rich.console import Console

    console, began, names = Console(stderr=True, markup=False, highlight=False), time.monotonic(), list[str]()

    def report(text: str) -> str | None:
        """Print the step `text` and the time left."""
        name = text.split(", epoch")[0]
        if name not in names:
            names.append(name)
        elif not console.is_terminal:
            return None
        return text + time_left(began, len(names) - 1, total)

    if not console.is_terminal or quiet():
        yield lambda text: note(line) if (line := report(text)) is not None else None
        return
    with console.status("") as status:
        yield lambda text: status.update(report(text) or text)


@contextmanager
def epochs_in_tensorboard(folder: Path) -> Iterator[OnEpoch]:
    """Yield what to call after each epoch; event files go to `folder`. Raises MissingExtraError without the library tensorboard."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        missing_extra("tensorboard", "tensorboard", "--tensorboard")
    with SummaryWriter(str(folder)) as writer:
        yield lambda epoch, epochs, error: writer.add_scalar("validation error", error, epoch)
