"""`nnhydro conceal`: campaigns with a hidden effect and a sealed answer."""

from pathlib import Path
from typing import Annotated

import typer

from nnhydro.cli.terminal.output import JSON, QUIET, conclude, emit, note, say, shell_words, table

Out = Annotated[Path, typer.Option("--out", help="Folder for the suite; an earlier suite there is replaced.")]
Effect = Annotated[str, typer.Option("--effect", help="What to hide: an effect of the catalogue, none, random, mixed (all kinds), "
                                     "base_form (the baseline's form is slightly off), unlisted (outside the catalogue); "
                                     "or several, comma-separated.")]
Strength = Annotated[str, typer.Option("--strength", help="strong: several times the smallest size that the campaign can reveal; "
                                       "weak: just above it.")]
Links = Annotated[int | None, typer.Option("--links", help="1 or 2; drawn where not given.")]
Count = Annotated[int, typer.Option("--count", help="Number of campaigns, for each effect where --effect is a list.")]
Effects = Annotated[int, typer.Option("--count-effects", help="Effects at once in a campaign, 1 to 3.")]
Seed = Annotated[int | None, typer.Option("--seed", help="The same seed gives the same campaigns; drawn where not given.")]
Key = Annotated[Path | None, typer.Option("--key", help="File with the key; written where it does not exist. Default: key.txt in --out.")]
Size = Annotated[str, typer.Option("--size", help="normal: 8 to 20 recordings of 6 to 12 s; small: 8 of 6 s at 50 Hz.")]
Acts = Annotated[str, typer.Option("--acts", help="When the effect acts. always; since: from one recording on; until: up to one recording; "
                                   "some: in some recordings; onset: from a time within one recording on; region: in a range of a joint's "
                                   "angle.")]


def conceal(out: Out, effect: Effect = "random", strength: Strength = "strong", links: Links = None, count: Count = 1, effects: Effects = 1,
            seed: Seed = None, key: Key = None, size: Size = "normal", acts: Acts = "always",
            quiet: bool = QUIET, json: bool = JSON) -> None:
    """Make campaigns with a hidden effect and a sealed answer.

    Each tow-tank campaign hides one effect, several (--count-effects) or none; `nnhydro reveal` scores a diagnosis against the answer.
    The truth is computed by code that shares nothing with the models and the catalogue.
    """
    import secrets

    from nnhydro.blind_tests.conceal import conceal as write
    from nnhydro.blind_tests.truth.campaign import Wish
    from nnhydro.errors import require

    require(1 <= count <= 999, f"--count {count}: choose 1 to 999")
    wishes = [Wish(name.strip(), strength, links, effects, size, acts) for name in effect.split(",") for _ in range(count)]
    made = write(out, wishes, secrets.randbits(40) if seed is None else seed, key, note)
    if json:
        emit({"suite": str(out), "campaigns": [vars(m) for m in made], "key": str(key or out / "key.txt")})
        return
    table(f"{out}: {len(made)} concealed campaigns", ("campaign", "links", "recordings", "baseline"),
          [(campaign.name, str(campaign.links), str(campaign.recordings), campaign.baseline) for campaign in made])
    say(f"The key is in {key or out / 'key.txt'}; hide it from whoever diagnoses.")
    conclude(f"{len(made)} campaign{'s' if len(made) > 1 else ''} with sealed answers in {out}.", following=f"nnhydro diagnose "
             f"{shell_words(out / made[0].name)} --out DIAGNOSES/{made[0].name}; then nnhydro reveal {shell_words(out)} --diagnoses "
             "DIAGNOSES")
