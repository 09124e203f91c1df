"""Full disks and folders that may not be written to, for every command: `python training/reliability/faults.py` (Linux, as root).

Each command writes to a small file system in memory: one with every size from far too small to ample, and one that is read-only. It must
say so in one line with exit code 2, and leave what was there, or succeed; nothing half written, nothing lost.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from kills import arguments
from trials import child, ended, prepare, record, show, tree

KILOBYTES = (0, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 4096)  # left free when the command begins


def mounted(work: Path, options: str, *more: str) -> None:
    """Mount a file system in memory at `work`."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, *more, "tmpfs", str(work)], check=True)


def outcome(line: Sequence[str], place: Path, before: dict[str, str]) -> str:
    """Run the command and judge what it said and left."""
    log, work = place / "log", place / "work"
    log.unlink(missing_ok=True)
    code, said = ended(child(line, log)), log.read_text()
    errors = [row for row in said.splitlines() if row.startswith("nnhydro: error: ")]
    if code == 0:
        return "done"
    if code != 2 or len(errors) != 1 or "Traceback" in said:
        return f"exit {code}: {said[-300:]}"
    # a training that was stopped keeps its last checkpoint beside the results of before, for --resume
    left = {name: digest for name, digest in tree(work).items() if name.startswith("out/")}
    return "refused" if left == before and not [p for p in work.iterdir() if p.name.startswith(".out")] else f"left {sorted(left)}"


def full(command: str, place: Path, free: int) -> str:
    """Let the command replace its results of before on a disk with so many kilobytes left."""
    work = place / "work"
    mounted(work, "size=8m")
    try:
        if ended(child(arguments(command, place, 1), place / "log")):
            return f"first run failed: {(place / 'log').read_text()[-300:]}"
        before = {name: digest for name, digest in tree(work).items() if name.startswith("out/")}
        room = subprocess.run(["df", "-k", "--output=avail", str(work)], capture_output=True, text=True, check=True).stdout.split()[-1]
        (work / "ballast").write_bytes(b"x" * (max(int(room) - free, 0) * 1024))
        return outcome(arguments(command, place, 2), place, before)
    finally:
        subprocess.run(["umount", str(work)], check=True)


def read_only(command: str, place: Path) -> str:
    """Let the command write to a file system that is read-only."""
    mounted(place / "work", "size=8m,ro")
    try:
        return outcome(arguments(command, place, 2), place, {})
    finally:
        subprocess.run(["umount", str(place / "work")], check=True)


def main() -> None:
    """Try, print and record."""
    given = dict(argument.split("=") for argument in sys.argv[1:])
    started, rows, faults = time.monotonic(), [], []
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        prepare(place)
        (place / "work").mkdir()
        for seed in (1, 2):
            (place / f"recipe{seed}.yaml").write_text((place / "recipe.yaml").read_text().replace("seed: 1", f"seed: {seed}"))
            (place / f"training{seed}.toml").write_text(f"seed = {seed}\n" + (place / "training.toml").read_text())
        for command in given.get("only", "train,simulate,conceal,benchmark,diagnose").split(","):
            tried = {f"{free} kB": full(command, place, free) for free in KILOBYTES} | {"read-only": read_only(command, place)}
            wrong = {fault: what for fault, what in tried.items() if what not in ("done", "refused")}
            faults += [f"{command}, {fault}: {what}" for fault, what in wrong.items()]
            rows.append([command, len(tried), *(list(tried.values()).count(what) for what in ("done", "refused")), len(wrong)])
    print("\n".join(faults))
    columns = ["command", "tries", "done", "refused in one line, nothing lost", "failures"]
    show("full and read-only disks", columns, rows)
    record("faults", {"seconds": round(time.monotonic() - started), "rows": [dict(zip(columns, row, strict=True)) for row in rows]})


if __name__ == "__main__":
    main()
