"""A newcomer's contributions: effect, statistic, report panel and feature set, each in a fresh clone with its page alone.

    python training/newcomer/contribute.py

Every file that a page shows is written, every line changed, every command typed. Prints a line a page and writes contributions.json: words
to read, files of the package touched (by git), lines added, seconds of the processor that its commands took.
"""

import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
from fenced import follow  # noqa: E402

from nnhydro.runtime.files import write_json  # noqa: E402

PAGES = {"a new effect": "effect", "a new statistic": "statistic", "a new panel of the report": "report_panel",
         "a new feature set": "feature_set"}
COLUMNS = ("words", "files", "lines", "cpu_s")


def contribute(page: Path, tree: Path) -> dict[str, object]:
    """Return what following `page` in the fresh clone `tree` took."""
    before = os.times()
    follow(page, tree)
    after = os.times()
    subprocess.run(["git", "add", "--intent-to-add", "nnhydro"], cwd=tree, check=True)
    rows = subprocess.run(["git", "diff", "--numstat", "--", "nnhydro"], cwd=tree, check=True, capture_output=True, text=True).stdout
    changes = [line.split("\t") for line in rows.splitlines()]
    return {"page": f"docs/contributing/{page.name}", "words": len(page.read_text(encoding="utf-8").split()),
            "files": len(changes), "lines": sum(int(added) for added, *_ in changes), "touched": [name for *_, name in changes],
            "cpu_s": round(after.children_user + after.children_system - before.children_user - before.children_system, 1)}


def main() -> None:
    """Follow every page and write what it took."""
    found = {}
    for title, name in PAGES.items():
        with tempfile.TemporaryDirectory() as folder:
            tree = Path(folder) / "nnhydro"
            subprocess.run(["git", "clone", "-q", "--no-local", str(ROOT), str(tree)], check=True)
            found[title] = contribute(tree / "docs" / "contributing" / f"{name}.md", tree)
        print(f"{title:26}", "  ".join(f"{key} {found[title][key]}" for key in COLUMNS), *found[title]["touched"], flush=True)
    write_json(HERE / "contributions.json", {"contributions": found, "python": platform.python_version(), "machine": platform.machine()})


if __name__ == "__main__":
    main()
