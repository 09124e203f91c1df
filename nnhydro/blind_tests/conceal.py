"""Write a suite of concealed campaigns: what a diagnosis may see, and sealed beside it what it is to find.

    suite.json                   baseline and commitment of every campaign
    campaign_000/                arm.yaml, recordings/, unseen/
    answers/campaign_000.sealed  the answer (seal.py)
    key.txt                      its key, unless --key names another file
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np
import yaml
from numpy.typing import NDArray

from nnhydro.blind_tests.oracle import true_torque
from nnhydro.blind_tests.seal import KEY_FILE, new_key, read_key, seal, write_key, write_sealed
from nnhydro.blind_tests.truth.campaign import SIZES, ConcealedCampaign, NotVisibleError, Wish, draw_campaign
from nnhydro.blind_tests.truth.partial_causes import KINDS
from nnhydro.blind_tests.truth.registry import names
from nnhydro.blind_tests.truth.visibility import FACTORS
from nnhydro.errors import ConfigError, require
from nnhydro.runtime.files import whole_folder, write_json, write_text
from nnhydro.runtime.registry import choices

SCHEMA = "nnhydro/suite/1"
MARKER = "suite.json"
SPECIAL = ("none", "random", "mixed", "base_form", "unlisted")
UNSHOWN = "no arm and motions were found that show it at that strength: try strength weak, two links or another seed"
DIGITS = {"rad": 7, "rad_s": 6, "rad_s2": 5, "Nm": 6, "m_s": 6, "m_s2": 6, "s": 5}


@final
@dataclass(frozen=True)
class MadeSuite:
    """One campaign of the suite as the public may know it."""

    name: str
    links: int
    recordings: int
    baseline: str
    commitment: str


def known_names() -> tuple[str, ...]:
    """Return everything that --effect takes."""
    return (*SPECIAL, *names(), *names("base_form"), *names("unlisted"))


def check_request(wish: Wish, count: int, seed: int, option: str = "--") -> None:
    """Raise ConfigError where something is asked for that cannot be made; messages put `option` before the names of what was asked."""
    several = f"{option}count-effects" if option == "--" else f"{option}effects"
    require(wish.effect in known_names(), f"{option}effect {wish.effect}: not known: {choices(wish.effect, known_names())}")
    require(wish.strength in FACTORS, f"{option}strength {wish.strength}: not known: {choices(wish.strength, FACTORS)}")
    require(wish.size in SIZES, f"{option}size {wish.size}: not known: {choices(wish.size, SIZES)}")
    require(wish.links in (None, 1, 2), f"{option}links {wish.links}: choose 1 or 2")
    require(1 <= count <= 999, f"{option}count {count}: choose 1 to 999")
    require(1 <= wish.effects <= 3, f"{several} {wish.effects}: choose 1 to 3")
    require(wish.acts in KINDS, f"{option}acts {wish.acts}: not known: {choices(wish.acts, KINDS)}")
    local = wish.effects == 1 and wish.effect in {"random", *names()} - {"added_mass", "torque_drift"}
    require(wish.acts == "always" or local, f"{option}acts {wish.acts}: needs one effect of the catalogue (or random) that is not "
            f"added_mass or torque_drift: leave {several} out")
    require(seed >= 0, f"{option}seed {seed}: give a whole number from 0 on")
    require(wish.effects == 1 or wish.effect in {"random", *names()} - {"added_mass"},
            f"{several} {wish.effects}: several at once need {option}effect random or an effect of the catalogue other than "
            "added_mass")
    need = [n for n in known_names() if n not in SPECIAL and n not in {*names("", 1), *names("base_form", 1), *names("unlisted", 1)}]
    require(wish.links != 1 or wish.effect not in need, f"{option}effect {wish.effect}: needs two links: leave {option}links out or give 2")


def _csv(columns: dict[str, NDArray[np.float64]]) -> str:
    formats = [f"%.{DIGITS[name.partition('_')[2]]}f" for name in columns]
    rows = np.column_stack([np.round(x, 9) for x in columns.values()]) + 0.0  # + 0.0 turns minus zero into zero
    return "\n".join([",".join(columns), *(",".join(formats) % tuple(row) for row in rows)]) + "\n"


def write_concealed(folder: Path, made: ConcealedCampaign) -> None:
    """Write the campaign's public files."""
    write_text(folder / "arm.yaml", yaml.safe_dump(made.arm, sort_keys=False))
    for file, columns in made.files.items():
        write_text(folder / file, _csv(columns))


def _key(given: Path | None) -> bytes:
    return read_key(given) if given is not None and given.is_file() else new_key()


def conceal(out: Path, wishes: list[Wish], seed: int, key_file: Path | None = None, progress: Callable[[str], None] = lambda line: None,
            ) -> tuple[MadeSuite, ...]:
    """Write one campaign a wish, in an order drawn by the seed, to `out` and return what was made; the same seed gives the same campaigns.

    `key_file` is read where it exists and written where it does not; without it the key is new and lies in `out`/key.txt. An existing `out`
    is replaced whole if it is a suite or empty, and refused otherwise. Raises ConfigError also where an effect cannot be made visible.
    """
    for wish in wishes:
        check_request(wish, len(wishes), seed)
    key, made = _key(key_file), []
    if key_file is not None and not key_file.is_file():
        write_key(key_file, key)  # before the answers: a key that was lost with a run that was ended could never open them
    wishes = [wishes[k] for k in np.random.default_rng([seed, len(wishes)]).permutation(len(wishes))]
    with whole_folder(out, MARKER) as work:
        for index, wish in enumerate(wishes):
            name = f"campaign_{index:03d}"
            try:
                drawn = draw_campaign(seed, index, wish)
            except NotVisibleError as cause:
                raise ConfigError(f"--effect {cause}: {UNSHOWN}") from cause
            write_concealed(work / name, drawn)
            for motion, unseen in drawn.unseen.items():
                drawn.answer["unseen"][motion]["true_model_Nm"] = true_torque(unseen, drawn.arm, _csv(unseen.links)).round(5).tolist()
            sealed = seal(name, drawn.answer | {"campaign": name}, key)
            write_sealed(work / "answers" / f"{name}.sealed", sealed)
            recordings = sum(file.startswith("recordings/") for file in drawn.files)
            made.append(MadeSuite(name, len(drawn.arm["links"]), recordings, drawn.baseline, sealed.commitment))
            progress(f"{name}: {recordings} recordings")
        public = {campaign.name: {"baseline": campaign.baseline, "commitment": campaign.commitment} for campaign in made}
        write_json(work / MARKER, {"schema": SCHEMA, "campaigns": public})
        if key_file is None:
            write_key(work / KEY_FILE, key)
    return tuple(made)
