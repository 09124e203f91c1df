"""What can be changed in a source file, and which lines a test has to run to notice it."""

import ast
import copy
import functools
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
PARTS = ("physics", "effects", "fitting", "diagnosis")
SWAP = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.MatMult: ast.Mult, ast.Pow: ast.Mult, ast.Lt: ast.LtE,
        ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And,
        ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd}
Lines = set[tuple[str, int]]  # file below the root, line


@dataclass(frozen=True)
class Mutant:
    """One place changed: the statement it stands in (to find it again after the file has moved on), before and after."""

    part: str
    file: str
    line: int
    statement: str
    before: str
    after: str
    source: str
    lines: frozenset[tuple[str, int]]

    @property
    def key(self) -> tuple[str, str, str, str]:
        """What stays when lines move."""
        return (self.file, self.statement, self.before, self.after)


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


def mutant(path: Path, number: int) -> Mutant:
    """Return the change of that number in the file."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    parent, field, index, made = list(places(tree))[number]
    child = getattr(parent, field) if index is None else getattr(parent, field)[index]
    file = str(path.relative_to(ROOT))
    way = _way(tree, child)
    statement = [node for node in way if isinstance(node, ast.stmt)][-1]
    lines = frozenset(_to_run(file, way))
    shown = " ".join("\n".join(text.splitlines()[line - 1] for line in sorted(_head(statement))).split())
    before, after = ast.unparse(child), ast.unparse(made)
    if index is None:
        setattr(parent, field, made)
    else:
        getattr(parent, field)[index] = made
    return Mutant(file.split("/")[1], file, child.lineno, shown[:300], before, after, ast.unparse(ast.fix_missing_locations(tree)), lines)


def _way(tree: ast.AST, wanted: ast.AST) -> list[ast.AST]:
    """Return the nodes from the module down to `wanted`."""
    if tree is wanted:
        return [tree]
    for child in ast.iter_child_nodes(tree):
        if below := _way(child, wanted):
            return [tree, *below]
    return []


def _head(statement: ast.stmt) -> set[int]:
    """Return the lines of a statement, without those of the statements in it."""
    inside = {line for child in ast.walk(statement) if isinstance(child, ast.stmt) and child is not statement
              for line in range(child.lineno, (child.end_lineno or child.lineno) + 1)}
    return set(range(statement.lineno, (statement.end_lineno or statement.lineno) + 1)) - inside


def _body(node: ast.AST) -> set[int]:
    """Return the lines of the bodies of every function in `node`."""
    return {line for function in ast.walk(node) if isinstance(function, ast.FunctionDef) for child in function.body
            for line in range(child.lineno, (child.end_lineno or child.lineno) + 1)}


def _to_run(file: str, way: list[ast.AST]) -> Lines:
    """Return the lines of which a test has to run one: the statement itself, or where what is set at import is used."""
    statement = [node for node in way if isinstance(node, ast.stmt)][-1]
    inside = [node for node, below in itertools.pairwise(way) if isinstance(node, ast.FunctionDef) and below in node.body]
    if inside:
        return {(file, line) for line in _head(statement)}
    if isinstance(statement, ast.FunctionDef):  # a default
        return {(file, line) for line in _body(statement)}
    names = {name.id for name in ast.walk(statement) if isinstance(name, ast.Name) and isinstance(name.ctx, ast.Store)}
    used = {place for name in names for place in _uses().get(name, ())}
    for owner in (node for node in way if isinstance(node, ast.ClassDef)):
        used |= _by_field() | {(file, line) for line in _body(owner)}
    return used or {(file, line) for line in _body(way[0])}


@functools.cache
def _by_field() -> Lines:
    """Return where parameters are read without their name: one field of the class after the other."""
    file = "nnhydro/physics/parametrised.py"
    return {(file, line) for line in _body(ast.parse((ROOT / file).read_text(encoding="utf-8")))}


@functools.cache
def _uses() -> dict[str, Lines]:
    """Return where in the package, inside functions, each name is read."""
    found: dict[str, Lines] = {}
    for path in sorted((ROOT / "nnhydro").rglob("*.py")):
        tree, file = ast.parse(path.read_text(encoding="utf-8")), str(path.relative_to(ROOT))
        bodies = _body(tree)
        for node in ast.walk(tree):
            name = node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else None
            if name and isinstance(node.ctx, ast.Load) and node.lineno in bodies:
                found.setdefault(name, set()).add((file, node.lineno))
    return found


def everywhere(parts: tuple[str, ...] = PARTS) -> list[tuple[Path, int]]:
    """Return every place that could be changed: file and number."""
    return [(path, number) for part in parts for path in sorted((ROOT / "nnhydro" / part).rglob("*.py"))
            for number in range(len(list(places(ast.parse(path.read_text(encoding="utf-8"))))))]
