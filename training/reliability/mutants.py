"""Do the tests notice wrong physics? `python training/reliability/mutants.py [count=80 seed=1 seconds=1800]`, `... again=1`.

One place of nnhydro/physics, identification or diagnosis is changed at a time: an operator, a comparison, a constant, a sign, a condition.
The fast tests of that part run until the first fails; a mutant that fails none, or that they never end on, is told apart. Places are
drawn evenly from all that could be changed, so the share of the killed estimates the share of all; its standard error is the binomial one.
With again=1 the mutants that survived last time are tried once more, after tests were written for them: a share of its own.
"""

import ast
import copy
import json
import os
import random
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
PARTS = ("physics", "identification", "diagnosis")
TESTS = {"physics": ("tests/physics/test_published_values.py", "tests/physics", "tests/contracts/test_load_terms.py",
                     "tests/unit/test_regressor.py"),
         "identification": ("tests/unit/test_separable.py", "tests/unit/test_penalised.py", "tests/unit/test_regressor.py",
                            "tests/unit/test_identification.py", "tests/unit/test_uncertainty.py", "tests/unit/test_streaming.py",
                            "tests/unit/test_training.py"),
         "diagnosis": ("tests/unit/test_diagnosis_pieces.py", "tests/unit/test_case.py", "tests/unit/test_proof.py",
                       "tests/unit/test_power.py",
                       "tests/unit/test_diagnosis.py", "tests/unit/test_effects_physics.py", "tests/contracts/test_effects.py")}
LIMIT = 240  # s for the tests of one mutant
SWAP = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.MatMult: ast.Mult, ast.Pow: ast.Mult, ast.Lt: ast.LtE,
        ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And,
        ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd}


def mutations(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what could stand in the place of `node`."""
    changed = copy.deepcopy(node)
    if isinstance(changed, ast.BinOp | ast.BoolOp | ast.AugAssign) and type(changed.op) in SWAP:
        changed.op = SWAP[type(changed.op)]()
        yield changed
    elif isinstance(changed, ast.Compare) and type(changed.ops[0]) in SWAP:
        changed.ops[0] = SWAP[type(changed.ops[0])]()
        yield changed
    elif isinstance(changed, ast.UnaryOp) and isinstance(changed.op, ast.USub | ast.Not):
        yield changed.operand
    elif isinstance(changed, ast.Constant) and type(changed.value) in (int, float):
        yield ast.copy_location(ast.Constant(changed.value + 1 if type(changed.value) is int else changed.value * 1.5 + 0.1), node)
    elif isinstance(changed, ast.IfExp):
        changed.body, changed.orelse = changed.orelse, changed.body
        yield changed


def _skipped(node: ast.AST) -> bool:
    """Annotations, and declarations of names and texts, hold nothing that runs."""
    return isinstance(node, ast.Import | ast.ImportFrom | ast.JoinedStr)


def places(tree: ast.AST) -> Iterator[tuple[ast.AST, str, int | None, ast.AST]]:
    """Yield (parent, field, index, replacement) for every change that could be made to the tree."""
    for parent in ast.walk(tree):
        if _skipped(parent):
            continue
        for field, value in ast.iter_fields(parent):
            if field in ("annotation", "returns", "decorator_list"):
                continue
            for index, child in enumerate(value) if isinstance(value, list) else [(None, value)]:
                if isinstance(child, ast.AST) and not _skipped(child):
                    yield from ((parent, field, index, made) for made in mutations(child))


def mutant(path: Path, number: int) -> tuple[str, int, str, str]:
    """Return the source with its change of that number, the line, and the line's code before and after."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    parent, field, index, made = list(places(tree))[number]
    child = getattr(parent, field) if index is None else getattr(parent, field)[index]
    before, after = ast.unparse(child), ast.unparse(made)
    if index is None:
        setattr(parent, field, made)
    else:
        getattr(parent, field)[index] = made
    return ast.unparse(ast.fix_missing_locations(tree)), child.lineno, before, after


def tested(path: Path, source: str, part: str) -> str:
    """Run the tests on the changed source in a child process; return killed, survived or never ended."""
    pid = os.fork()
    if not pid:
        code = 70
        try:
            os.setpgid(0, 0)
            code = _pytest_with(path, source, part)
        finally:
            os._exit(code)
    end = time.monotonic() + LIMIT
    while time.monotonic() < end:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return "survived" if os.waitstatus_to_exitcode(status) == 0 else "killed"
        time.sleep(0.1)
    os.killpg(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    return "never ended"


def _pytest_with(path: Path, source: str, part: str) -> int:
    import importlib.machinery

    import pytest

    real = importlib.machinery.SourceFileLoader.get_code

    def get_code(self, name):
        return compile(source, str(path), "exec") if Path(self.path).resolve() == path else real(self, name)
    importlib.machinery.SourceFileLoader.get_code = get_code
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    chosen = [str(ROOT / test) for test in TESTS[part] if (ROOT / test).exists()]
    return int(pytest.main(["-q", "-x", "-m", "not slow", "-p", "no:cacheprovider", "--no-header", f"--rootdir={ROOT}", *chosen]))


def survivors(everywhere: list[tuple[str, Path, int]]) -> list[tuple[str, Path, int]]:
    """Return the places whose mutants survived the recorded run; those whose code has changed since are left out."""
    recorded = json.loads((Path(__file__).parent / "results.json").read_text(encoding="utf-8"))["mutants"]["survived"]
    known = {(row["file"], row["before"], row["after"]) for row in recorded}
    files = {row["file"] for row in recorded}
    found = {}
    for part, path, number in everywhere:
        name = str(path.relative_to(ROOT))
        if name in files:
            _, line, before, after = mutant(path, number)
            near = [row["line"] for row in recorded if (row["file"], row["before"]) == (name, before[:80])]
            if (name, before[:80], after[:80]) in known and min(abs(line - one) for one in near) < 1:
                found.setdefault((name, line, before, after), (part, path, number))
    return list(found.values())


def main() -> None:
    """Draw, change, test, print and record."""
    given = dict(argument.split("=") for argument in sys.argv[1:])
    count, seed, seconds = int(given.get("count", 80)), int(given.get("seed", 1)), float(given.get("seconds", 1800))
    import pandas  # noqa: F401  what every child needs, imported once; nnhydro itself is imported by each child anew
    import pytest  # noqa: F401
    import scipy.interpolate
    import scipy.optimize
    import scipy.signal  # noqa: F401
    import sklearn.ensemble  # noqa: F401
    import torch  # noqa: F401

    everywhere = [(part, path, number) for part in given.get("parts", ",".join(PARTS)).split(",")
                  for path in sorted((ROOT / "nnhydro" / part).rglob("*.py"))
                  for number in range(len(list(places(ast.parse(path.read_text(encoding="utf-8"))))))]
    again = "again" in given
    drawn = survivors(everywhere) if again else random.Random(seed).sample(everywhere, count)
    started, rows = time.monotonic(), []
    for part, path, number in drawn:
        if time.monotonic() - started > seconds:
            break
        source, line, before, after = mutant(path, number)
        began = time.monotonic()
        rows.append({"part": part, "file": str(path.relative_to(ROOT)), "line": line, "before": before[:80], "after": after[:80],
                     "end": tested(path, source, part), "seconds": round(time.monotonic() - began, 1)})
        print(f"{rows[-1]['end']:12s} {rows[-1]['seconds']:6.1f} s  {rows[-1]['file']}:{line}: {before[:70]}  ->  {after[:70]}", flush=True)
    from trials import record, show

    table = []
    for part in (*PARTS, "all"):
        of = [row for row in rows if part in (row["part"], "all")]
        killed = sum(row["end"] != "survived" for row in of)
        share = killed / max(len(of), 1)
        doubt = (share * (1 - share) / max(len(of), 1)) ** 0.5
        table.append([part, len(of), killed, f"{100 * share:.0f} +- {100 * doubt:.0f}"])
    columns = ["part", "mutants", "killed (or never ended)", "killed, %"]
    show(f"mutants, of {len(everywhere)} possible", columns, table)
    document = {"seed": seed, "possible": len(everywhere), "seconds": round(time.monotonic() - started),
                "rows": [dict(zip(columns, row, strict=True)) for row in table],
                "survived": [row for row in rows if row["end"] == "survived"]}
    record("mutants again" if again else "mutants", document)


if __name__ == "__main__":
    main()
