"""Inputs that no reader may stumble over: `python training/reliability/fuzz.py [seconds=1500 seed=1 only=csv,parquet engine=atheris]`.

Valid files are changed (tests/fuzz/mutations.py) and read. A reader gives a result or one line: any other exception, more than 5 s, more
than 1 GiB or the death of the process is a failure, and its input is kept in tests/fuzz/corpus, which the tests replay. With engine=atheris
changes are guided by the coverage of nnhydro's own code (pip install atheris).
"""

import hashlib
import mmap
import os
import random
import resource
import signal
import struct
import sys
import time
import traceback
import warnings
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tests" / "fuzz"))
CORPUS = ROOT / "tests" / "fuzz" / "corpus"
SLOW, LARGE = 5.0, 1 << 30  # s, bytes
SHARES = {"key": 0.3, "suite.json": 0.5, "csv": 1.5, "recipe": 1.5, "model.json": 1.5}  # of the time, where not 1


class Ledger:
    """What a child has done, in memory that its parent sees after its death: inputs, accepted, failures, peak of the memory in bytes."""

    def __init__(self) -> None:
        self.memory = mmap.mmap(-1, 40)

    def write(self, *values: int) -> None:
        """Note inputs, accepted, failures, extra bytes, time of the last input in ms."""
        self.memory[:40] = struct.pack("5q", *values)

    def read(self) -> tuple[int, ...]:
        """Return what was noted last."""
        return struct.unpack("5q", self.memory[:40])


def where(error: BaseException) -> str:
    """Return the kind of the exception and the line of nnhydro that raised it or called what did."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if "/nnhydro/" in f.filename]
    place = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "outside"
    return f"{type(error).__name__} at {place}"


def keep(target: str, data: bytes, why: str, seen: dict[str, int]) -> None:
    """Keep an input that failed, the first two of each kind, and say so."""
    seen[why] = seen.get(why, 0) + 1
    if seen[why] <= 2:
        folder = CORPUS / target.replace(" ", "_")
        folder.mkdir(parents=True, exist_ok=True)
        name = hashlib.sha256(data).hexdigest()[:12]
        (folder / name).write_bytes(data)
        print(f"{target}: {why} ({name}, {len(data)} bytes)", flush=True)


def once(target, data: bytes, place: Path, seen: dict[str, int]) -> tuple[bool, bool]:
    """Read one input; return whether it was accepted and whether it failed."""
    start = time.perf_counter()
    try:
        accepted, failed = target(data, place), False
    except Exception as error:  # whatever it is: this is what is looked for
        keep(target.name, data, where(error), seen)
        accepted, failed = False, True
    if time.perf_counter() - start > SLOW:
        keep(target.name, data, "took more than 5 s", seen)
        failed = True
    return accepted, failed


def worker(target, seed: int, seconds: float, ledger: Ledger, place: Path) -> None:
    """Change and read until the time is over; never returns."""
    from mutations import mutated

    warnings.simplefilter("ignore")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # libraries in C complain there
    rng, seen, done, accepted, failures, extra = random.Random(seed), {}, 0, 0, 0, 0
    for data in target.seeds:
        target(data, place)
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    space = int(Path("/proc/self/statm").read_text().split()[0]) * 4096
    resource.setrlimit(resource.RLIMIT_AS, (space + LARGE + (LARGE >> 1),) * 2)
    pool, end = list(target.seeds), time.monotonic() + seconds
    while time.monotonic() < end:
        data = mutated(rng.choice(pool), rng, target.text)
        (place / "input").write_bytes(data)
        ledger.write(done, accepted, failures, extra, int(time.monotonic() * 1000))
        ok, failed = once(target, data, place, seen)
        now = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 - base
        if now > LARGE >= extra:
            keep(target.name, data, "took more than 1 GiB", seen)
            failed = True
        done, accepted, failures, extra = done + 1, accepted + ok, failures + failed, max(now, extra)
        if ok and len(pool) < 300 and len(data) < 60_000 and rng.random() < 0.05:
            pool.append(data)  # what is still valid is changed further
    ledger.write(done, accepted, failures, extra, int(time.monotonic() * 1000))
    os._exit(0)


def fuzzed(target, seed: int, seconds: float) -> tuple[int, int, int, int]:
    """Fuzz in children until the time is over; return inputs, accepted, failures, peak of extra memory."""
    total, end, seen = [0, 0, 0, 0], time.monotonic() + seconds, {}
    with TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as folder:
        while (left := end - time.monotonic()) > 1:
            ledger, seed = Ledger(), seed + 1
            pid = os.fork()
            if not pid:
                worker(target, seed, left, ledger, Path(folder))
            died, status = 0, 0
            while not died:
                time.sleep(0.2)
                died, status = os.waitpid(pid, os.WNOHANG)
                if not died and ledger.read()[4] and time.monotonic() * 1000 - ledger.read()[4] > 1000 * (SLOW + 10):
                    os.kill(pid, signal.SIGKILL)
            done, accepted, failures, extra, _ = ledger.read()
            if status:
                why = f"the process ended with {os.waitstatus_to_exitcode(status)}"
                keep(target.name, (Path(folder) / "input").read_bytes(), why, seen)
                done, failures = done + 1, failures + 1
            total = [total[0] + done, total[1] + accepted, total[2] + failures, max(total[3], extra)]
    return tuple(total)


def guided(name: str, seconds: float) -> None:
    """Let libFuzzer change the inputs, guided by coverage; its own report goes to standard error; never returns."""
    import atheris

    with atheris.instrument_imports(include=["nnhydro", "yaml", "tomllib"]):
        from targets import targets
    target, seen, folder = targets()[name], {}, TemporaryDirectory()
    begin = Path(folder.name) / "seeds"
    begin.mkdir()
    for number, data in enumerate(target.seeds):
        (begin / str(number)).write_bytes(data)
    options = [f"-max_total_time={seconds:.0f}", f"-timeout={SLOW:.0f}", "-rss_limit_mb=2048", "-max_len=20000", "-print_final_stats=1"]
    atheris.Setup([sys.argv[0], str(begin), *options], lambda data: once(target, data, Path(folder.name), seen))
    atheris.Fuzz()


def main() -> None:
    """Fuzz every target for its share of the time, print and record."""
    given = dict(argument.split("=") for argument in sys.argv[1:])
    seconds, seed, started = float(given.get("seconds", 1500)), int(given.get("seed", 1)), time.monotonic()
    if given.get("engine") == "atheris":
        guided(given["only"], seconds)
    from targets import targets
    from trials import record, show

    chosen = {name: target for name, target in targets().items() if name in given.get("only", name).split(",")}
    shares = {name: SHARES.get(name, 1.0) for name in chosen}
    rows = []
    for name, target in chosen.items():
        done, accepted, failures, extra = fuzzed(target, seed * 1000, seconds * shares[name] / sum(shares.values()))
        rows.append([name, done, accepted, failures, f"{extra / 1e6:.0f}"])
        print(rows[-1], flush=True)
    rows.append(["all", *(sum(row[k] for row in rows) for k in (1, 2, 3)), max((row[4] for row in rows), key=float)])
    columns = ["read", "inputs", "accepted", "failures", "peak of memory, MB more than at rest"]
    show("fuzzing", columns, rows)
    if "only" not in given:
        record("fuzz", {"seconds": round(time.monotonic() - started), "seed": seed,
                        "rows": [dict(zip(columns, row, strict=True)) for row in rows]})


if __name__ == "__main__":
    main()
