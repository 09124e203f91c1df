"""The tables and the picture of docs/architecture.md, made from the package: `python docs/_ext/architecture_tables.py`."""

import ast
from functools import cache
from itertools import chain
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[2]
PACKAGE, PAGE, PICTURE = ROOT / "nnhydro", ROOT / "docs" / "architecture.md", ROOT / "docs" / "architecture.svg"
ORDER = ["problem", "model", "noise", "search", "decision", "findings", "calibration", "unexplained", "experiment"]  # of the method
CELL = 26  # pixels
# folders and figures of the tree of 23 November 2026, before the moves (decisions/0031)
BEFORE = (("`recordings` 48", ("recordings",)), ("`physics` 53", ("physics", "dynamics")), ("`effects` 42", ("effects",)),
          ("`features` 16", ("features",)), ("`models` 29, `exchange` 6", ("models", "deployment")), ("`identification` 22", ("fitting",)),
          ("`evaluation` 21", ("evaluation",)), ("`simulation` 53", ("simulation", "blind_tests")), ("`diagnosis` 51", ("diagnosis",)),
          ("`report` 34, `cli` 18", ("report", "cli")), ("`api` 9", ("api",)), ("files beside the folders 7", ("runtime", "")))
FIGURES_BEFORE = {"Python files": 410, "folders with modules": 26, "most modules in a folder that is no registry": 50,
                  "median lines of a module outside registries": 98, "lines of the longest module": 272,
                  "class names that stand twice": 31, "folders inside the diagnosis": 0}


def folders(package: Path) -> list[str]:
    """Return the folders of `package` that hold modules."""
    return sorted(p.name for p in package.iterdir() if (p / "__init__.py").exists())


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """Return all nodes of the file at `path`, which several tables ask for."""
    return tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


@cache
def depends(package: Path, dotted: str) -> dict[str, tuple[str, ...]]:
    """Return for each folder of `package` the others that it imports from, at the top of a file or inside a function."""
    names = folders(package)
    found: dict[str, tuple[str, ...]] = {}
    for name in names:
        used = set()
        for path in (package / name).rglob("*.py"):
            for node in nodes(path):
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


def figures() -> dict[str, int]:
    """Return the figures of the tree as it is, in the order of FIGURES_BEFORE."""
    paths = sorted(PACKAGE.rglob("*.py"))
    tests = ast.parse((ROOT / "tests" / "test_architecture.py").read_text(encoding="utf-8"))
    registries = next(ast.literal_eval(node.value) for node in tests.body
                      if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "REGISTRIES")
    inner = [path for path in paths if path.stem[:2] != "__"]
    outside = [path for path in inner if str(path.parent.relative_to(PACKAGE)) not in registries]
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in inner}
    classes = [node.name for node in chain.from_iterable(map(nodes, paths))
               if isinstance(node, ast.ClassDef)]
    values = (len(paths), len({path.parent for path in inner} - {PACKAGE}),
              max(modules(folder) for folder in {path.parent for path in outside} - {PACKAGE}),
              int(median(lines[path] for path in outside)), max(lines.values()), len(classes) - len(set(classes)),
              len(folders(PACKAGE / "diagnosis")))
    return dict(zip(FIGURES_BEFORE, values, strict=True))


def tree() -> str:
    """Return the tree before and after: files of each folder, and figures of the whole."""
    def count(name: str) -> str:
        found = len(list((PACKAGE / name).rglob("*.py") if name else PACKAGE.glob("*.py")))
        return f"`{name}` {found}" if name else f"files beside the folders {found}"

    rows = [f"| {before} | {', '.join(map(count, after))} |" for before, after in BEFORE]
    now = figures()
    rows += [f"| {name}: {before} | {now[name]} |" for name, before in FIGURES_BEFORE.items()]
    return "\n".join(["| before | after |", "| --- | --- |", *rows]) + "\n"


def picture() -> str:
    """Return the imports as a design structure matrix in SVG: a dot where the folder of the row imports from that of the column."""
    graph = depends(PACKAGE, "nnhydro")
    level = floors(graph)
    names = [name for name in sorted(graph, key=lambda name: (level[name], name)) if modules(PACKAGE / name)]
    size, left, top = CELL * len(names), 120, 110
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left + size + 50} {top + size + 10}" font-family="sans-serif" '
             'font-size="14" fill="#123">', "<title>Who imports from whom: a dot where a row imports from a column</title>",
             f'<rect width="{left + size + 50}" height="{top + size + 10}" fill="#fff"/>']
    for i, row in enumerate(names):
        y = top + i * CELL
        parts.append(f'<text x="{left - 8}" y="{y + 17}" text-anchor="end">{row}</text>'
                     f'<text transform="translate({left + i * CELL + 17} {top - 8}) rotate(-60)">{row}</text>')
        for j, column in enumerate(names):
            x = left + j * CELL
            shade = "#cfd8e3" if i == j else "#f4f7fa" if j < i else "#fff"
            parts.append(f'<rect x="{x}" y="{y}" width="{CELL}" height="{CELL}" fill="{shade}" stroke="#dde"/>')
            if column in graph[row]:
                parts.append(f'<circle cx="{x + CELL / 2:g}" cy="{y + CELL / 2:g}" r="6" fill="#246"/>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def page() -> str:
    """Return the page with its tables as they should be."""
    text = PAGE.read_text(encoding="utf-8")
    level = floors(depends(PACKAGE, "nnhydro"))
    tables = {"folders": table(PACKAGE, "nnhydro", sorted(level, key=lambda name: (level[name], name))),
              "diagnosis": table(PACKAGE / "diagnosis", "nnhydro.diagnosis", ORDER), "tree": tree()}
    for mark, made in tables.items():
        before, _, rest = text.partition(f"<!-- {mark} -->\n")
        text = f"{before}<!-- {mark} -->\n{made}<!-- end of {mark} -->\n{rest.partition(f'<!-- end of {mark} -->' + chr(10))[2]}"
    return text


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    PICTURE.write_text(picture(), encoding="utf-8")
