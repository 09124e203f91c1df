"""Is anything half written, or lost, where a run is killed? `python training/reliability/kills.py [kills=200 seed=1]`.

Every command is killed -9 at moments drawn evenly over its run, and right before operations on files that it does. After each
kill the place of the results holds nothing, the results of before, or the new ones, whole; a training is taken up with --resume until it
ends, in the very bytes of one that was never stopped. One undisturbed run at the end leaves nothing hidden behind.
"""

import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from trials import child, ended, killed, prepare, record, show, tree

from nnhydro.errors import NnhydroError
from nnhydro.models.storage import MODEL, load_model
from nnhydro.runtime.files import read_json

WRITING = ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.chmod", "shutil.rmtree")  # audit events
STRIDE = {"train": 37, "simulate": 1, "conceal": 1, "benchmark": 5, "diagnose": 5}  # a training writes after every epoch
SAME = {"train", "conceal", "simulate"}  # whose results are the same bytes every time; the others say how long they took


@dataclass
class Count:
    """What happened to one command."""

    kills: int = 0
    half: int = 0  # something visible that is neither whole nor of before
    lost: int = 0  # results of before that are gone
    differ: int = 0  # resumed or repeated results in other bytes
    resumed: int = 0
    operations: int = 0
    faults: list[str] = field(default_factory=list)


def arguments(command: str, place: Path, seed: int) -> list[str]:
    """Return the command line, whose results go to the folder `out` of the place."""
    out = ["--out", str(place / "work" / "out"), "--quiet"]
    return {"train": ["train", str(place / "tank"), "--config", str(place / f"training{seed}.toml"), *out],
            "simulate": ["simulate", str(place / f"recipe{seed}.yaml"), *out],
            "conceal": ["conceal", "--size", "small", "--links", "1", "--effect", "none", "--seed", str(seed), "--key",
                        str(place / "key.txt"), *out],
            "benchmark": ["benchmark", str(place / "tank"), "--models", "constant,rigid", "--folds", "2", "--seed", str(seed), *out],
            "diagnose": ["diagnose", str(place / "suite" / "campaign_000"), "--seed", str(seed), *out]}[command]


def whole(folder: Path, wanted: dict[str, str], exactly: bool) -> bool:
    """Return whether `folder` holds the files `wanted`, in the same bytes or at least readable to the end."""
    found = tree(folder)
    if exactly or found.keys() != wanted.keys():
        return found == wanted
    try:
        for path in folder.rglob("*.json"):
            read_json(path, NnhydroError)
        for path in folder.rglob(MODEL):
            load_model(path.parent)
    except NnhydroError:
        return False
    return all(path.read_text().rstrip().endswith("</html>") for path in folder.rglob("*.html"))


def undisturbed(command: str, place: Path, seed: int) -> tuple[dict[str, str], float]:
    """Run the command to its end; return what it wrote and the seconds that it took."""
    start = time.monotonic()
    code = ended(child(arguments(command, place, seed), place / "log"))
    if code:
        raise SystemExit(f"{command} ended with {code}: {(place / 'log').read_text()[-500:]}")
    return tree(place / "work" / "out"), time.monotonic() - start


def dying(work: Path, number: int) -> Callable[[], None]:
    """Return what makes a process kill itself right before its operation of that number on files in `work`."""
    def arm() -> None:
        seen = 0

        def watch(event: str, given: tuple[object, ...]) -> None:
            nonlocal seen
            if event in WRITING and str(given[0]).startswith(str(work)):
                reading = event == "open" and isinstance(given[2], int) and not given[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
                seen += not reading
                if seen == number:
                    os.kill(os.getpid(), signal.SIGKILL)
        sys.addaudithook(watch)
    return arm


class Trial:
    """One command under fire."""

    def __init__(self, command: str, place: Path) -> None:
        self.command, self.place, self.work, self.count = command, place, place / "work", Count()
        self.old, _ = undisturbed(command, place, 1)
        self.new, self.seconds = undisturbed(command, place, 2)

    def check(self, moment: str) -> None:
        """Look at what a killed run left where people look."""
        visible = {path.name for path in self.work.iterdir() if not path.name.startswith(".")}
        strange = {name for name in visible - {"out"} if not (self.command == "train" and name.startswith("out.checkpoint."))}
        out, exactly = self.work / "out", self.command in SAME
        if not out.exists():
            self.count.lost += 1
            self.count.faults.append(f"{moment}: results gone")
        elif strange or not (whole(out, self.new, exactly) or whole(out, self.old, exactly)):
            self.count.half += 1
            self.count.faults.append(f"{moment}: {sorted(strange) or 'neither old nor new'}")

    def again(self) -> list[str]:
        """Return the command line that a person would type after a kill."""
        resume = self.command == "train" and (self.work / "out.checkpoint.safetensors").exists()
        self.count.resumed += resume
        return [*arguments(self.command, self.place, 2), *(["--resume"] if resume else [])]

    def finish(self, moment: str) -> None:
        """Let it run to its end; what comes out must be what an undisturbed run gave, with nothing hidden beside it."""
        code = ended(child(self.again(), self.place / "log"))
        left = {path.name for path in self.work.iterdir()} - {"out"}
        if code or left or not whole(self.work / "out", self.new, self.command in SAME):
            self.count.differ += 1
            self.count.faults.append(f"{moment}: exit {code}, left {sorted(left)}")

    def at_random(self, kills: int, rng: random.Random) -> None:
        """Kill at `kills` random moments; every fifth time it may finish."""
        while self.count.kills < kills:
            moment = rng.uniform(0, self.seconds)
            if killed(child(self.again(), self.place / "log"), moment):
                self.count.kills += 1
                self.check(f"{moment:.3f} s")
            if self.count.kills % 5 == 4:
                self.finish(f"after {moment:.3f} s")
        self.finish("at the end")

    def at_operations(self) -> None:
        """Kill before operations on files: the first dozen, then every `STRIDE`th."""
        for number in (*range(1, 13), *range(13, 10_000, STRIDE[self.command])):
            undone = ended(child(self.again(), self.place / "log", dying(self.work, number))) == -signal.SIGKILL
            if not undone:
                break
            self.count.operations += 1
            self.check(f"operation {number}")
            if self.command == "train":
                self.finish(f"after operation {number}")
        self.finish("at the end")


def main() -> None:
    """Kill, look, print and record."""
    given = dict(argument.split("=") for argument in sys.argv[1:])
    kills, rng, rows, started = int(given.get("kills", 200)), random.Random(int(given.get("seed", 1))), [], time.monotonic()
    commands = given.get("only", "train,simulate,conceal,benchmark,diagnose").split(",")
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        prepare(place)
        for seed in (1, 2):
            (place / f"recipe{seed}.yaml").write_text((place / "recipe.yaml").read_text().replace("seed: 1", f"seed: {seed}"))
            (place / f"training{seed}.toml").write_text(f"seed = {seed}\n" + (place / "training.toml").read_text())
        for command in commands:
            (place / "work").mkdir()
            trial = Trial(command, place)
            trial.at_operations()
            trial.at_random(-(-kills // len(commands)), rng)
            count = trial.count
            print("\n".join(f"{command}: {fault}" for fault in count.faults), end="\n" if count.faults else "", flush=True)
            rows.append([command, f"{trial.seconds:.2f}", count.kills, count.operations, count.half, count.lost, count.differ,
                         count.resumed])
            (place / "work").rename(place / f"done_{command}")
    columns = ["command", "one run, s", "killed at random", "killed before an operation on files", "half written", "lost",
               "result differs from an undisturbed run", "resumed"]
    show("kill -9", columns, rows)
    record("kills", {"seconds": round(time.monotonic() - started), "rows": [dict(zip(columns, row, strict=True)) for row in rows]})


if __name__ == "__main__":
    main()
