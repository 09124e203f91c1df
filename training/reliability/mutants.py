"""Do the tests notice wrong physics? `python training/reliability/mutants.py [count=500 seed=1 seconds=36000 budget=12]`, `... again=1`.

One place of physics, effects, fitting or diagnosis is changed at a time: an operator, a comparison, a constant, a sign, a condition.
Of the fast tests those run that execute the changed line (covered.py says which; what is set at import: the lines that use it), shortest
first, until one fails. Places are drawn evenly from all that could be changed, so the share of the killed estimates the share of all; its
standard error is the binomial one. A mutant that is equivalent (no input shows a difference worth having: equivalent.json, with the reason)
counts as survived in the first score and is left out of the second. Results are appended one by one to runs/mutants_SEED.jsonl: a stopped
run goes on where it was. With again=1 the survivors of that file that are not equivalent are tried once more, after tests were written for
them.
"""

import importlib.machinery
import json
import os
import random
import resource
import signal
import sys
import time
from pathlib import Path

from covered import RUNS, STORE, read
from places import PARTS, ROOT, Mutant, everywhere, mutant
from trials import record, show

BUDGET = 12.0  # s of tests a mutant, as they took without it; budget=60 for a second look at what survived
LIMIT = 30.0  # s of processor more than five times what the tests take without the change: it never ends
EQUIVALENT = Path(__file__).with_name("equivalent.json")


def chosen(mutant: Mutant, covered: dict, budget: float) -> list[str]:
    """Return the tests that run the mutant's lines: those of every file in turn, shortest first, as many as the budget holds.

    Lines that numba compiles are not seen by coverage.py: there, and where no test runs a line, those of the files that import the module.
    """
    tests: set[str] = set()
    for file, line in mutant.lines:
        tests |= set(covered["lines"].get(file, {}).get(str(line), ()))
    module = mutant.file.removesuffix(".py").replace("/", ".")
    importing = (path for path in (ROOT / "tests").rglob("test_*.py") if f"{module} import" in path.read_text(encoding="utf-8"))
    whole = {name for name in tests if "::" not in name} if tests else {str(path.relative_to(ROOT)) for path in importing}
    tests |= {name for name in covered["seconds"] if name.partition("::")[0] in whole}
    ranked, rank = [], {}
    for name in sorted(tests - set(covered["failed"]) - whole, key=lambda name: covered["seconds"].get(name, 0.0)):
        file = name.partition("::")[0]
        rank[file] = rank.get(file, 0) + 1
        ranked.append((rank[file] // 8, covered["seconds"].get(name, 0.0), name))
    spent, kept = 0.0, []
    for _, seconds, name in sorted(ranked):
        if not kept or spent + seconds <= budget:
            kept.append(name)
            spent += seconds
    return kept


class Only:
    """Runs the chosen tests alone, in their order, and keeps the first that fails."""

    def __init__(self, names: list[str]) -> None:
        self.order, self.failed = {name: i for i, name in enumerate(names)}, ""

    def pytest_collection_modifyitems(self, items) -> None:
        """Leave out what was not chosen."""
        items[:] = sorted((item for item in items if item.nodeid in self.order), key=lambda item: self.order[item.nodeid])

    def pytest_collectreport(self, report) -> None:
        """A file that cannot be imported any more has noticed."""
        if report.failed:
            self.failed = self.failed or report.nodeid

    def pytest_runtest_logreport(self, report) -> None:
        """The first failure ends the run."""
        if report.failed:
            self.failed = self.failed or report.nodeid


def tested(mutant: Mutant, names: list[str], seconds: float) -> tuple[str, str]:
    """Run the tests on the changed source in a child process; return killed, survived or never ended, and the test that failed."""
    if not names:
        return "survived", "no fast test runs the line"
    reader, writer = os.pipe()
    pid = os.fork()
    if not pid:
        try:
            most = int(LIMIT + 5 * seconds)
            resource.setrlimit(resource.RLIMIT_CPU, (most, most + 5))  # of the processor, not of the clock: others may be at work
            os.write(writer, _failed_with(mutant, names).encode()[:4000] + b"\n")
        except BaseException as error:
            os.write(writer, f"{type(error).__name__}: {error}\n".encode()[:4000])
        finally:
            os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as pipe:
        said = pipe.read()
    if os.WTERMSIG(status := os.waitpid(pid, 0)[1]) == signal.SIGXCPU:
        return "never ended", f"{len(names)} tests"
    failed = said.strip()
    return ("killed", failed or f"ended with status {status}") if failed or status else ("survived", f"{len(names)} tests")


def _failed_with(mutant: Mutant, names: list[str]) -> str:
    """Return the id of the test that fails with the mutant in place, or nothing."""
    import pytest

    path, real = ROOT / mutant.file, importlib.machinery.SourceFileLoader.get_code

    def get_code(self, name):
        return compile(mutant.source, str(path), "exec") if Path(self.path).resolve() == path else real(self, name)
    importlib.machinery.SourceFileLoader.get_code = get_code
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    for some in (names[:60], names[60:]):  # most fall to the first few: the files of the others need no import then
        only = Only(some)
        if some:
            code = pytest.main(["-q", "-x", "-p", "no:cacheprovider", "--no-header", f"--rootdir={ROOT}",
                                *sorted({str(ROOT / name.partition("::")[0]) for name in some})], plugins=[only])
            if only.failed or code:
                return only.failed or f"pytest ended with {code}"
    return ""


def equivalent() -> dict[tuple[str, ...], str]:
    """Return the reason by (file, statement, before, after) of the mutants that were read and found to change nothing."""
    rows = json.loads(EQUIVALENT.read_text(encoding="utf-8")) if EQUIVALENT.exists() else []
    return {(row["file"], row["statement"], row["before"], row["after"]): row["reason"] for row in rows}


def table(rows: list[dict]) -> tuple[list[str], list[list]]:
    """Return columns and rows of the scores, part by part."""
    same, out = equivalent(), []
    for part in (*PARTS, "all"):
        of = [row for row in rows if part in (row["part"], "all")]
        survived = [row for row in of if row["end"] == "survived"]
        alike = sum((row["file"], row["statement"], row["before"], row["after"]) in same for row in survived)
        killed, n = len(of) - len(survived), max(len(of), 1)
        doubt = 100 * (killed / n * (1 - killed / n) / n) ** 0.5
        out.append([part, len(of), killed, f"{100 * killed / n:.1f} +- {doubt:.1f}", alike, f"{100 * killed / max(n - alike, 1):.1f}"])
    return ["part", "mutants", "killed (or never ended)", "killed, %", "survivors found equivalent", "killed of the others, %"], out


def _latest(path: Path) -> dict[tuple[str, ...], dict]:
    """Return the last result of every mutant in the file, in the order of the draw."""
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []
    return {(row["file"], row["statement"], row["before"], row["after"], row["line"]): row for row in rows}


def main() -> None:
    """Draw, change, test, print and record."""
    given = dict(argument.split("=") for argument in sys.argv[1:])
    count, seed, seconds = int(given.get("count", 500)), int(given.get("seed", 1)), float(given.get("seconds", 36000))
    covered = read(STORE)
    import pandas  # noqa: F401  what every child needs, imported once; nnhydro itself is imported by each child anew
    import scipy.interpolate
    import scipy.optimize
    import scipy.signal  # noqa: F401
    import sklearn.ensemble  # noqa: F401
    import torch  # noqa: F401

    for name in [name for name in sys.modules if name.partition(".")[0] == "nnhydro"]:
        del sys.modules[name]
    store, started = RUNS / f"mutants_{seed}.jsonl", time.monotonic()
    possible = everywhere(tuple(given.get("parts", ",".join(PARTS)).split(",")))
    before, same = _latest(store), equivalent()
    for path, number in random.Random(seed).sample(possible, count):
        if time.monotonic() - started > seconds:
            break
        one = mutant(path, number)
        old = before.get((*one.key, one.line))
        if old and (old["end"] != "survived" or "again" not in given or one.key in same):
            continue
        names, began = chosen(one, covered, float(given.get("budget", BUDGET))), time.monotonic()
        end, by = tested(one, names, sum(covered["seconds"].get(name, 0.0) for name in names))
        row = {"part": one.part, "file": one.file, "line": one.line, "statement": one.statement, "before": one.before, "after": one.after,
               "end": end, "by": by, "seconds": round(time.monotonic() - began, 1), "again": bool(old)}
        with store.open("a", encoding="utf-8") as handle:
            handle.write(json.dumps(row) + "\n")
        print(f"{end:12s} {row['seconds']:6.1f} s  {one.file}:{one.line}: {one.before[:70]}  ->  {one.after[:70]}  [{by[:90]}]", flush=True)
    rows = list(_latest(store).values())
    columns, lines = table(rows)
    show(f"mutants, of {len(possible)} possible", columns, lines)
    record(f"mutants_{seed}", {"seed": seed, "possible": len(possible), "rows": [dict(zip(columns, line, strict=True)) for line in lines],
                       "survived": [row for row in rows if row["end"] == "survived"]})


if __name__ == "__main__":
    main()
