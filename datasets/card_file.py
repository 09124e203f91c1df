"""What every make.py ends with: card.toml says how the files were made, and holds their sums. And the arguments that each takes."""

from __future__ import annotations

import argparse
import hashlib
import platform
import re
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path


def arguments(description: str | None, folder: Path) -> argparse.ArgumentParser:
    """Return the parser of a make.py whose files lie in `folder` unless --out says otherwise."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--out", type=Path, default=folder)
    parser.add_argument("--only", help="remake this recording or unseen motion alone")
    return parser


def files_in(out: Path, *folders: str) -> list[Path]:
    """Return arm.yaml and every file of the named folders in `out`."""
    return [out / "arm.yaml", *(path for folder in folders for path in sorted((out / folder).iterdir()))]


def write_card(folder: Path, out: Path, seed: int, files: Iterable[Path], libraries: Iterable[str] = ("numpy", "scipy")) -> None:
    """Keep the hand-written head of card.toml and renew what follows: how the `files` were made, and their sums."""
    head = re.split(r"^\[made\]", (folder / "card.toml").read_text(), flags=re.M)[0]
    made = [f"seed = {seed}", *(f'{name} = "{version(name)}"' for name in libraries)]
    if len(made) > 1:
        made.insert(1, f'python = "{platform.python_version()}"')
    places = {path: path.relative_to(out if path.is_relative_to(out) else folder).as_posix() for path in files}
    sums = [f'"{place}" = "{hashlib.sha256(path.read_bytes()).hexdigest()}"' for path, place in places.items()]
    (out / "card.toml").write_text(head + "\n".join(["[made]", *made, "", "[sha256]", *sums]) + "\n")
