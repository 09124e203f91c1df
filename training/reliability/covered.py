"""Which test runs which line: `pip install coverage; python training/reliability/covered.py [slow=1]`, stored in runs/covered.json.

The fast suite (with slow=1 the slow tests alone) runs once under coverage.py, each test as a context of its own. Lines that a fixture of a
wider scope runs belong to all tests of its file. Tests that fail without any change are noted, and never asked about a mutant.
`covered.py tests/unit/test_lines.py ...` measures those files alone and puts them into what is stored: after tests were written.
"""

import json
import sys
from pathlib import Path

import pytest
from places import PARTS, ROOT

RUNS = Path(__file__).resolve().parent / "runs"
# they run whole programs, or other people's
ASIDE = ("tests/web", "tests/docs", "tests/fuzz", "tests/test_release.py", "tests/test_architecture.py")
STORE = RUNS / "covered.json"


class Contexts:
    """Tells coverage.py which test is running, and keeps how long each took and which failed."""

    def __init__(self, measured) -> None:
        self.measured, self.seconds, self.failed = measured, {}, []

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        """Lines from here on are those of this test."""
        self.measured.switch_context(item.nodeid)
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef, request):
        """What a shared fixture runs counts for its whole file."""
        if fixturedef.scope == "function":
            return (yield)
        self.measured.switch_context(request.node.nodeid.partition("::")[0])
        try:
            return (yield)
        finally:
            self.measured.switch_context(request._pyfuncitem.nodeid)

    def pytest_runtest_logreport(self, report) -> None:
        """Add up set-up, call and tear-down."""
        self.seconds[report.nodeid] = round(self.seconds.get(report.nodeid, 0.0) + report.duration, 3)
        if report.failed:
            self.failed.append(report.nodeid)


def main() -> None:
    """Run the tests under coverage and store what they ran."""
    import coverage

    slow = "slow=1" in sys.argv
    measured = coverage.Coverage(data_file=None, config_file=False, source=[str(ROOT / "nnhydro" / part) for part in PARTS], messages=False)
    measured.set_option("run:disable_warnings", ["no-data-collected", "module-not-measured", "module-not-imported", "already-imported"])
    contexts = Contexts(measured)
    measured.start()
    chosen = [name for name in sys.argv[1:] if name.startswith("tests")] or ["tests"]
    pytest.main(["-q", "-m", "slow" if slow else "not slow", "-p", "no:cacheprovider", f"--rootdir={ROOT}", *chosen,
                 *(f"--ignore={name}" for name in ASIDE)], plugins=[contexts])
    measured.stop()
    data = measured.get_data()
    by_file = {str(Path(file).relative_to(ROOT)): data.contexts_by_lineno(file) for file in data.measured_files()}
    lines = {file: {str(line): [name for name in by if name] for line, by in found.items()} for file, found in by_file.items()}
    store = STORE.with_name("covered_slow.json") if slow else STORE
    fresh = {"seconds": contexts.seconds, "failed": contexts.failed, "lines": lines}
    write(store, fresh if chosen == ["tests"] or not store.exists() else merged(read(store), fresh, chosen))
    print(f"{len(contexts.seconds)} tests, {sum(contexts.seconds.values()):.0f} s, {len(contexts.failed)} failed: {contexts.failed}")


def merged(old: dict, new: dict, files: list[str]) -> dict:
    """Return what is stored with the tests of `files` measured anew."""
    def others(name: str) -> bool:
        return name.partition("::")[0] not in files

    lines: dict[str, dict[str, list[str]]] = {}
    for part, keep in ((old, others), (new, lambda name: True)):
        for file, by_line in part["lines"].items():
            for line, names in by_line.items():
                lines.setdefault(file, {}).setdefault(line, []).extend(name for name in names if keep(name))
    return {"seconds": {name: s for name, s in old["seconds"].items() if others(name)} | new["seconds"],
            "failed": [name for name in old["failed"] if others(name)] + new["failed"], "lines": lines}


def write(store: Path, found: dict) -> None:
    """Write with a number for every name: each stands on thousands of lines."""
    names = sorted({name for by_line in found["lines"].values() for on in by_line.values() for name in on})
    number = {name: i for i, name in enumerate(names)}
    RUNS.mkdir(exist_ok=True)
    store.write_text(json.dumps({"names": names, **found, "lines": {
        file: {line: [number[name] for name in on] for line, on in by_line.items()} for file, by_line in found["lines"].items()}}))


def read(store: Path) -> dict:
    """Return what `write` was given."""
    kept = json.loads(store.read_text())
    names = kept.pop("names")
    lines = {file: {line: [names[i] for i in on] for line, on in by_line.items()} for file, by_line in kept["lines"].items()}
    return kept | {"lines": lines}


if __name__ == "__main__":
    main()
