"""What `nnhydro effects` prints: the catalogue as a list, and the card of one effect."""

from collections.abc import Sequence
from textwrap import fill

from nnhydro.cli.terminal.output import say
from nnhydro.effects.catalogue import ACTS
from nnhydro.effects.effect import Effect, InstrumentEffect

WIDTH = 100
WIDE = 200  # of tables when the output is piped


def _words(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table of words, every column from the left."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        console = Console(highlight=False, markup=False, width=WIDE)
    made = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, title_style="bold")
    for name in columns:
        made.add_column(name, overflow="fold")
    for row in rows:
        made.add_row(*row)
    console.print(made)


def print_list(effects: Sequence[type[Effect]]) -> None:
    """Print one line per effect."""
    rows = [(effect.id, effect.family, ACTS[effect.acts], effect.name, effect.signature.region) for effect in effects]
    _words(f"{len(effects)} effects that a simulation may omit", ("id", "family", "acts on", "name", "what it looks like"), rows)
    say("nnhydro effects ID explains one.")


def _paragraph(title: str, text: str) -> None:
    say(fill(f"{title:<18}{text}", WIDTH, subsequent_indent=" " * 18, break_long_words=False, break_on_hyphens=False))


def print_card(effect: type[Effect]) -> None:
    """Print all that the card says, for someone who never met the term."""
    seen = effect.signature
    say(f"{effect.name[0].upper()}{effect.name[1:]} ({effect.id})")
    say()
    _paragraph("What happens", effect.mechanism)
    _paragraph("Equation", effect.equation)
    _paragraph("Seen", seen.region)
    _paragraph("Depends on", ", ".join(seen.depends_on))
    _paragraph("Mirrored motion", {"odd": "gives the mirrored torque", "even": "gives the same torque",
                                   "mixed": "gives another torque: the effect has a direction"}[seen.parity])
    _paragraph("At rest", "it vanishes" if seen.zero_at_rest else "it remains")
    _paragraph("Excited by", seen.excited_by)
    _paragraph("Mistaken for", ", ".join(seen.mistaken_for))
    _paragraph("Acts on", ACTS[effect.acts] + (", through what the sensors read" if issubclass(effect, InstrumentEffect) else ""))
    _paragraph("Family", effect.family)
    _paragraph("Source", effect.source)
    say()
    rows = []
    for field in effect.parameters():
        said = field.metadata
        one_a = effect.acts if said["per"] == "arm" else said["per"]
        rows.append((field.name, said["meaning"], said["unit"], one_a, "{:g} to {:g}".format(*said["bounds"])))
    _words("Parameters", ("name", "meaning", "unit", "one per", "bounds"), rows)
