"""The tables and the picture of docs/architecture.md, made from the package: `python docs/_ext/architecture_tables.py`."""

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE, PAGE, PICTURE = ROOT / "nnhydro", ROOT / "docs" / "architecture.md", ROOT / "docs" / "architecture.svg"
BASE = "conventions, errors, files"  # modules beside the folders: everybody may cite them
ORDER = ["problem", "model", "noise", "search", "calibration", "decision", "findings", "unexplained", "experiment"]  # of the method
WIDE, HIGH, GAP, ROW = 118, 34, 14, 62  # pixels of a box, between boxes, between floors


def folders(package: Path) -> list[str]:
    """Return the folders of `package` that hold modules."""
    return sorted(p.name for p in package.iterdir() if (p / "__init__.py").exists())


@cache
def depends(package: Path, dotted: str) -> dict[str, tuple[str, ...]]:
    """Return for each folder of `package` the others that it imports from, at the top of a file or inside a function."""
    names = folders(package)
    found: dict[str, tuple[str, ...]] = {}
    for name in names:
        used = set()
        for path in (package / name).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                modules = ([alias.name for alias in node.names] if isinstance(node, ast.Import) else
                           [f"{node.module}.{alias.name}" for alias in node.names] if isinstance(node, ast.ImportFrom) else [])
                used |= {m.removeprefix(f"{dotted}.").split(".")[0] for m in modules if m.startswith(f"{dotted}.")}
        found[name] = tuple(sorted(used & set(names) - {name}))
    return found


def floors(graph: dict[str, tuple[str, ...]]) -> dict[str, int]:
    """Return the length of the longest chain of imports below each folder."""
    level: dict[str, int] = {}

    def height(name: str, above: tuple[str, ...] = ()) -> int:
        if name not in level:
            assert name not in above, f"imports go round in a circle: {' > '.join((*above, name))}"
            level[name] = 1 + max((height(other, (*above, name)) for other in graph[name]), default=-1)
        return level[name]
    for name in graph:
        height(name)
    return level


def holds(folder: Path) -> str:
    """Return what the folder says of itself: the first line of its docstring."""
    text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))) or ""
    return text.splitlines()[0] if text else ""


def modules(folder: Path) -> int:
    """Return the number of modules in `folder` itself."""
    return sum(path.stem != "__init__" for path in folder.glob("*.py"))


def table(package: Path, dotted: str, order: list[str]) -> str:
    """Return one row a folder: what it holds, what it depends on, its modules, and those of its subfolders."""
    graph = depends(package, dotted)
    rows = []
    for name in sorted(graph, key=lambda name: order.index(name) if name in order else len(order)):
        inner = ", ".join(f"{sub}/ {modules(package / name / sub)}" for sub in folders(package / name))
        count = f"{modules(package / name)}{f' + {inner}' if inner and dotted == 'nnhydro' else ''}"
        rows.append(f"| `{name}` | {holds(package / name)} | {', '.join(graph[name]) or '-'} | {count} |")
    return "\n".join(["| folder | holds | depends on | modules |", "| --- | --- | --- | --- |", *rows]) + "\n"


def reduced(graph: dict[str, tuple[str, ...]]) -> list[tuple[str, str]]:
    """Return the arrows that no longer path replaces (transitive reduction)."""
    def reach(name: str) -> set[str]:
        return set(graph[name]).union(*(reach(other) for other in graph[name]))
    return [(name, other) for name in graph for other in graph[name]
            if not any(other in reach(third) for third in graph[name] if third != other)]


def picture() -> str:
    """Return the folders as SVG: a box each, the lowest floor below, an arrow to what is imported directly."""
    graph = depends(PACKAGE, "nnhydro")
    level = floors(graph)
    top = max(level.values())
    rows = [[name for name in sorted(graph) if level[name] == k] for k in range(top + 1)]
    width = max(len(row) for row in rows) * (WIDE + GAP) + GAP
    place = {}
    for k, row in enumerate(rows):
        left = (width - len(row) * (WIDE + GAP) + GAP) / 2
        place |= {name: (left + i * (WIDE + GAP), GAP + (top - k) * ROW) for i, name in enumerate(row)}
    height = top * ROW + HIGH + 2 * GAP
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" font-family="sans-serif" font-size="14">',
             "<title>Folders of nnhydro; an arrow leads from a folder to one that it imports from</title>",
             '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
             '<path d="M0 0L8 4L0 8z" fill="#556"/></marker></defs>', f'<rect width="{width:g}" height="{height:g}" fill="#fff"/>']
    for name, other in reduced(graph):
        (x, y), (to_x, to_y) = place[name], place[other]
        way = f"M{x + WIDE / 2:g} {y + HIGH:g}L{to_x + WIDE / 2:g} {to_y:g}"
        parts.append(f'<path d="{way}" stroke="#889" fill="none" marker-end="url(#tip)"/>')
    for name, (x, y) in place.items():
        parts.append(f'<rect x="{x:g}" y="{y:g}" width="{WIDE}" height="{HIGH}" rx="5" fill="#eef3f8" stroke="#456"/>'
                     f'<text x="{x + WIDE / 2:g}" y="{y + 22:g}" text-anchor="middle" fill="#123">{name}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def page() -> str:
    """Return the page with its tables as they should be."""
    text = PAGE.read_text(encoding="utf-8")
    level = floors(depends(PACKAGE, "nnhydro"))
    tables = {"folders": table(PACKAGE, "nnhydro", sorted(level, key=lambda name: (level[name], name))),
              "diagnosis": table(PACKAGE / "diagnosis", "nnhydro.diagnosis", ORDER)}
    for mark, made in tables.items():
        before, _, rest = text.partition(f"<!-- {mark} -->\n")
        text = f"{before}<!-- {mark} -->\n{made}<!-- end of {mark} -->\n{rest.partition(f'<!-- end of {mark} -->' + chr(10))[2]}"
    return text


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    PICTURE.write_text(picture(), encoding="utf-8")
