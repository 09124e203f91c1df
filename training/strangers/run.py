"""Strangers' folders from their files to a verdict by commands alone, each with its time: `python training/strangers/run.py [KIND ...]`.

The campaigns are made by tests/strangers.py, which shares nothing with nnhydro: foreign formats (German CSV, 1 kHz with repeated stamps,
20 Hz) and arms that hide a slack cable, a drag crisis, Stribeck friction, or all of it at once. Every command is one that the command
before it named, or that the README names; nothing else is typed and no script stands between. Prints every command, its last line, where
its seconds went, and writes transcript.txt and results.json beside this file; what other kinds gave before stays there.
"""

import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from strangers import C_D, C_M, HEALTHY, HIDING, write  # noqa: E402 - found by the path above

COMMANDS = ("check {c}", "benchmark {c} --models constant,textbook --out compared", "identify {c} --out my_model",
            "diagnose {c} --out diagnosis", "predict diagnosis/model {c}/recordings/{first} --out torques")


def type_in(command: str, place: Path) -> tuple[str, float, float]:
    """Type a command in `place`; return what it prints, its seconds on the wall and on the processor."""
    before, start = os.times(), time.perf_counter()
    done = subprocess.run([sys.executable, "-m", "nnhydro", *command.split()], cwd=place, capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}", "OMP_NUM_THREADS": "1"})
    after = os.times()
    if done.returncode:
        sys.exit(f"nnhydro {command}: ended with {done.returncode}: {done.stderr}")
    worked = after.children_user + after.children_system - before.children_user - before.children_system
    return done.stdout, time.perf_counter() - start, worked


def ending(out: str) -> list[str]:
    """The verdict of a command and the command that it names next."""
    lines = [line.rstrip() for line in out.splitlines() if line.strip()]
    last = next((k for k, line in enumerate(lines) if line.startswith("Next: ")), len(lines))
    verdict = next(k for k in range(last - 1, -1, -1) if not lines[k].startswith("  "))
    return [lines[verdict], *lines[last:last + 1]]


def walk(kind: str) -> tuple[list[str], dict[str, object]]:
    """Take the campaign `kind` from its folder to its verdict; return the transcript and what came of it."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        campaign = write(place / kind.replace(" ", "_"), kind)
        first = sorted((campaign / "recordings").glob("*.csv"))[0]
        first = first.rename(first.with_name(first.name.replace(" ", "_")))  # typed here by one word a name
        said, spent = [f"\n# {kind}"], []
        for command in COMMANDS:
            line = command.format(c=campaign.name, first=first.name)
            out, wall, worked = type_in(line, place)
            spent.append((line.split()[0], wall, worked))
            said += [f"$ nnhydro {line}", *ending(out), f"[{wall:.1f} s, {worked:.1f} s of the processor]"]
        document = json.loads((place / "diagnosis" / "diagnosis.json").read_text())
        found = json.loads((place / "my_model" / "model.json").read_text())
    told = {"named": [[f["effect"], round(f["confidence"], 2)] for f in document["findings"]],
            "detected": document["mismatch"]["detected"],
            "errors": [document["mismatch"]["error"], document["proof"]["error_after"]],
            "seconds": round(sum(wall for _, wall, _ in spent), 1), "processor_s": round(sum(worked for *_, worked in spent), 1),
            "steps": [{"command": name, "seconds": round(wall, 1), "processor_s": round(worked, 1)} for name, wall, worked in spent]}
    values = (found.get("fit") or {}).get("parameters") or {}
    told["C_D"], told["C_M"] = (round(values[name]["value"], 3) if name in values else None
                                for name in ("normal_drag.C_D[1]", "added_mass.C_M[1]"))
    return said, told


def table(kinds: dict[str, dict[str, Any]]) -> str:
    """Return the table of README.md, one row per campaign."""
    steps = " + ".join(step["command"] for step in next(iter(kinds.values()))["steps"])
    lines = [f"| campaign | C_D, C_M of `identify` (made with {C_D}, {C_M}) | named (confidence) | held-out error "
             f"| seconds of the processor: {steps} |", "|" + " --- |" * 5]
    for kind in (kind for kind in (*HEALTHY, *HIDING) if kind in kinds):
        told = kinds[kind]
        named = ", ".join(f"{name} ({sure:.2f})" for name, sure in told["named"]) or ("no name" if told["detected"] else "nothing")
        before, after = (f"{100 * error:.1f}" for error in told["errors"])
        seconds = " + ".join(f"{step['processor_s']:.0f}" for step in told["steps"])
        lines.append(f"| {kind} | {told['C_D']}, {told['C_M']} | {named} | {before} -> {after} % | {seconds} |")
    return "\n".join(lines)


def main() -> None:
    """Walk every kind that was asked for, all by default; write transcript and results."""
    chosen = sys.argv[1:] or [*HEALTHY, *HIDING]
    unknown = [kind for kind in chosen if kind not in (*HEALTHY, *HIDING)]
    if unknown:
        sys.exit(f"{unknown[0]}: none of {', '.join((*HEALTHY, *HIDING))}")
    results = HERE / "results.json"
    known = json.loads(results.read_text()) if results.exists() else {"kinds": {}, "transcripts": {}}
    for kind in chosen:
        said, told = walk(kind)
        print("\n".join(said), flush=True)
        known["kinds"][kind], known["transcripts"][kind] = told, said
        known |= {"truth": {"C_D": C_D, "C_M": C_M}, "machine": platform.machine(), "cores": os.cpu_count(),
                  "load": round(os.getloadavg()[1], 1), "python": platform.python_version()}
        results.write_text(json.dumps(known, indent=1) + "\n")
    every = [kind for kind in (*HEALTHY, *HIDING) if kind in known["kinds"]]
    (HERE / "transcript.txt").write_text("\n".join(line for kind in every for line in known["transcripts"][kind]).lstrip() + "\n")
    print(table(known["kinds"]))


if __name__ == "__main__":
    main()
