"""A large program of scalars as C: loops over tables instead of one statement a scalar, so that it stays in the cache and vectorises.

All values lie in one vector v. Every round of the schedule (deployment/onnx/schedule.py) first computes the sums that it needs, long ones
over the same atoms as small matrices, the others term by term, then each kind of function as one loop. A matrix whose rows come in pairs
that differ in the signs of some atoms only (a network and its mirror image) is computed once for both:

    y = E x_even + O x_odd,   y' = E x_even - O x_odd

Equal matrices over different atoms (a law on every strip) are one product, the strips side by side; two of them (a network's second layer
and that of its mirror image) read each weight once. Atoms and sums lie in the order of what they are made of, so that a loop or a product
reads what lies side by side: an index read for each number costs more than the sum itself.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.deployment.c_constants import ConstantTables
from nnhydro.deployment.c_kernels import LANES, ROOTS, columns_product, dense, dots, name_columns_product, name_dots, together
from nnhydro.deployment.c_places import Places, last_uses
from nnhydro.deployment.c_runs import Stretch, by_operand, fewest_runs, output_statements, statements, stretches
from nnhydro.deployment.onnx.choices import Choice, best_choice
from nnhydro.deployment.onnx.expressions import Program, Row, Value, row_of
from nnhydro.deployment.onnx.row_blocks import alike_rows, mirror_pairs
from nnhydro.deployment.onnx.schedule import rounds

LONG: Final = 8  # terms: longer sums over the same atoms go as a matrix
PAD: Final = 4  # rows: matrices are filled up to whole vectors of the processor
WIDE: Final = 24  # rows of a matrix that are summed side by side, in registers
TWICE: Final = 16  # rows of a matrix for two columns
WRITTEN: Final = 8  # values: so few are written out, a call takes longer
FIXED: Final = 32  # places: shorter runs are loops of a fixed length
FEW: Final = 3  # rows: with fewer, a matrix that stands alone is sums
SIDE: Final = 4  # equal matrices from which on they are one product, PAD at least
SIDE_BY_SIDE: Final = 5  # vectors of strips side by side, in registers
LOOPS: Final = {"mul": "{0}*{1}", "div": "{0}/{1}", "max": "({0} > {1} ? {0} : {1})", "min": "({0} < {1} ? {0} : {1})",
                "where": "({0} > R(0.5) ? {1} : {2})", "positive": "({0} > R(0.0) ? R(1.0) : R(0.0))",
                "zero": "({0} == R(0.0) ? R(1.0) : R(0.0))", "sign": "(real)(({0} > R(0.0)) - ({0} < R(0.0)))"}


@final
@dataclass
class Tables:
    """Collects the C text of a program: `lines` the statements; `places` tells where in v values lie."""

    program: Program
    constants: ConstantTables
    memory: Places
    lines: list[str] = field(default_factory=list)
    kernels: dict[tuple[str, str], str] = field(default_factory=dict)  # parameters and body -> name

    @property
    def places(self) -> dict[Row, int]:
        """Where in v values lie."""
        return self.memory.at

    def slots(self, rows: Sequence[Row]) -> int:
        """Give `rows` places in v side by side; returns the first."""
        return self.memory.take(rows)

    def copies(self, places: Sequence[int]) -> int:
        """Copy what lies at `places` side by side, for this round; returns the first place."""
        first = self.memory.block(len(places), self.memory.now)
        self.lines.append(f"for (int i = 0; i < {len(places)}; ++i) v[{first} + i] = v[{self.constants.table(places, True)}[i]];")
        return first

    def _matrix(self, blocks: Sequence[tuple[Sequence[int | None], int]], W: NDArray[np.float64]) -> None:
        """W x, x being the atoms of each of one or two `blocks`, into the places from the block's number on."""
        k, sources = W.shape[1], []
        for atoms, _ in blocks:
            at = [self.places[((a, 1.0),)] for a in atoms]
            if at != list(range(at[0], at[0] + k)):
                at = [self.copies(at)]
            sources.append(f"v + {at[0]}")
        for start, table, high, n in self._rows_of(W, WIDE if len(blocks) == 1 else TWICE):
            columns = ", ".join(f"{source}, v + {out + start}" for source, (_, out) in zip(sources, blocks, strict=True))
            self.lines.append(f"{{at}}dense{high}x{len(blocks)}({columns}, {k}, {table}, {n});")
            self.products.add((high, len(blocks)))

    products: set[tuple[int, int]] = field(default_factory=set)
    column_products: set[tuple[int, int, str]] = field(default_factory=set)
    dots: set[tuple[int, bool, str, str]] = field(default_factory=set)
    alike: dict[tuple[int | None, ...], list[Row]] = field(default_factory=dict)  # all long rows of the program by their atoms
    choice: Choice = Choice(())  # what is needed only where a condition holds

    def _block(self, atoms: tuple[int | None, ...], rows: list[Row]) -> None:
        """Rows over the same atoms."""
        W = np.array([[c for _, c in row] for row in rows])
        paired = mirror_pairs(W)
        if paired is None:
            self._matrix([(atoms, self.slots(rows))], W)
            return
        pairs, s = paired
        ahead, mirror = [rows[a] for a, _ in pairs], [rows[b] for _, b in pairs]
        m, first = len(pairs), self.slots([*ahead, *mirror])
        half = W[[a for a, _ in pairs]]
        for sign, out in ((s > 0, first), (s < 0, first + m)):
            self._matrix([([a for a, chosen in zip(atoms, sign, strict=True) if chosen], out)], half[:, sign])
        self.lines.append(f"for (int i = 0; i < {m}; ++i) {{ const real e = v[{first} + i], o = v[{first + m} + i]; "
                          f"v[{first} + i] = e + o; v[{first + m} + i] = e - o; }}")

    def _side_by_side(self, blocks: list[tuple[tuple[int | None, ...], list[Row]]]) -> None:
        """Rows that repeat over other atoms: row by row, all blocks beside each other."""
        orders = [blocks, sorted(blocks, key=lambda block: self.places[((block[0][0], 1.0),)])]
        read = [np.array([[self.places[((a, 1.0),)] for a in atoms] for atoms, _ in order]).T for order in orders]
        blocks, at = min(zip(orders, read, strict=True), key=lambda order: int((np.diff(order[1], axis=1) != 1).any(axis=1).sum()))
        g, k, m = len(blocks), len(blocks[0][0]), len(blocks[0][1])
        apart = np.flatnonzero((np.diff(at, axis=1) != 1).any(axis=1))
        if apart.size:
            at[apart, 0] = self.copies(at[apart].ravel().tolist()) + g * np.arange(apart.size)
        first = self.slots([rows[i] for i in range(m) for _, rows in blocks])
        columns = np.array_split(np.arange(g), -(-g // (PAD * SIDE_BY_SIDE)))
        vectors = -(-len(columns[0]) // PAD)
        high = together(m, vectors)
        W = np.zeros((-(-m // high) * high, k))
        W[:m] = [[c for _, c in row] for row in blocks[0][1]]
        table, starts = self.constants.table(W.reshape(-1, high, k).transpose(0, 2, 1), False), self.constants.table(at[:, 0], True)
        self.column_products.add((vectors, high, self.constants.kinds[starts]))
        kernel = name_columns_product(vectors, high, self.constants.kinds[starts])
        for part in columns:
            self.lines.append(f"{kernel}(v + {part[0]}, {starts}, {k}, {table}, v + {first + part[0]}, {g}, {m}, {len(part) - PAD});")

    def _rows_of(self, W: NDArray[np.float64], most: int) -> Iterator[tuple[int, str, int, int]]:
        """Rows of W (m, k) summed together, `most` at most: number of the first, table, how many with those filled up, how many."""
        for part in np.array_split(np.arange(len(W)), -(-len(W) // most)):
            padded = np.zeros((-(-len(part) // PAD) * PAD, W.shape[1]))
            padded[:len(part)] = W[part]
            yield int(part[0]), self.constants.table(padded.T, False), len(padded), len(part)

    def sums(self, wanted: Sequence[Row]) -> None:
        """Compute every row in `wanted` that is not there yet."""
        fresh = [row for row in dict.fromkeys(wanted) if row not in self.places]
        by_atoms: dict[tuple[int | None, ...], list[Row]] = defaultdict(list)
        for row in fresh:
            atoms = tuple(k for k, _ in row)
            if row in by_atoms[atoms]:
                continue  # with the others over these atoms
            by_atoms[atoms] = [other for other in self.alike[atoms] if other not in self.places and (other in self.choice.rows) == (
                row in self.choice.rows)] if len(atoms) > LONG else [*by_atoms[atoms], row]
        short, alike = [], dict[tuple[Any, bytes], list[tuple[tuple[int | None, ...], list[Row]]]]()
        for atoms, rows in by_atoms.items():
            if len(atoms) > LONG:
                W = np.array([[c for _, c in row] for row in rows])
                alike.setdefault((W.shape, W.tobytes()), []).append((atoms, rows))
            else:
                short += rows
        for blocks in alike.values():
            if len(blocks) >= SIDE:
                self._side_by_side(blocks)
            elif len(blocks[0][1]) < FEW:
                short += [row for _, rows in blocks for row in rows]
            elif len(blocks) == 2 and mirror_pairs(W := np.array([[c for _, c in row] for row in blocks[0][1]])) is None:
                self._matrix([(atoms, self.slots(rows)) for atoms, rows in blocks], W)
            else:
                for atoms, rows in blocks:
                    self._block(atoms, rows)
        for width in sorted({len(row) for row in short}):
            self._short([row for row in short if len(row) == width], width)

    def _short(self, rows: list[Row], width: int) -> None:
        """Rows of the same few terms each: one loop; longer ones are sums each."""
        if width > LONG:
            self._long(rows, width)
            return
        places = {row: [self.places[((atom, 1.0),)] for atom, _ in row] for row in rows}
        signs = {row: [c for _, c in row if abs(c) == 1.0] for row in rows}
        orders = [rows, sorted(rows, key=places.__getitem__), sorted(rows, key=lambda row: (signs[row], places[row]))]
        rows, at = fewest_runs([(order, by_operand(places[row] for row in order)) for order in orders])
        first = self.slots(rows)
        weights = by_operand([c for _, c in row] for row in rows)
        for stretch in stretches(at):
            self._loop(at, first, stretch, " + ".join(f"{{{k}}}" for k in range(width)), weights)

    def _long(self, rows: list[Row], width: int) -> None:
        """Rows of `width` terms over unlike atoms, those over atoms side by side first: one call for each sort."""
        at = {row: [self.places[((a, 1.0),)] for a, _ in row] for row in rows}
        running = {row: places == list(range(places[0], places[0] + width)) for row, places in at.items()}
        for sort in (True, False):
            part = [row for row in rows if running[row] is sort]
            if not part:
                continue
            weights = {tuple(c for _, c in row): None for row in part}
            begins = {c: width * k for k, c in enumerate(weights)}
            which = self.constants.table([begins[tuple(c for _, c in row)] for row in part], True)
            places = self.constants.table([p for row in part for p in at[row][:1 if sort else width]], True)
            kind = (width, sort, self.constants.kinds[which], self.constants.kinds[places])
            self.dots.add(kind)
            c, first = self.constants.table([x for c in weights for x in c], False), self.slots(part)
            self.lines.append(f"{name_dots(*kind)}(v, v + {first}, {len(part)}, {c}, {which}, {places});")

    def round(self, kinds: dict[str, list[int]]) -> None:
        """Compute the atoms `kinds` {kind: atoms}, those of a choice where it is made."""
        always, chosen = ({kind: part for kind, atoms in kinds.items() if (part := [k for k in atoms if (k in self.choice.atoms) == taken])}
                          for taken in (False, True))
        self._operations(always)
        if chosen:
            rows = [row_of(x) for atoms in chosen.values() for k in atoms for x in self.program.atoms[k].operands]
            self.sums([row for row in rows if row not in self.choice.rows])
            before, self.lines = self.lines, []
            self._operations(chosen)
            place = self.places.get(self.choice.condition)
            self.lines = [*before, *(self.lines if place is None else [f"if (v[{place}] > R(0.5)) {{", *self.lines, "}"])]

    def _operations(self, kinds: dict[str, list[int]]) -> None:
        """Compute the atoms `kinds` {kind: atoms}."""
        operands = {k: [row_of(x) for x in self.program.atoms[k].operands] for atoms in kinds.values() for k in atoms}
        self.sums([operands[k][slot] for atoms in kinds.values() for slot in range(max(len(operands[k]) for k in atoms))
                   for k in atoms if slot < len(operands[k])])
        for kind, atoms in kinds.items():
            if kind in ("maxof", "minof"):
                self._extremes(kind, atoms, operands)
                continue
            if kind == "same":
                self.places.update({((k, 1.0),): self.places[operands[k][0]] for k in atoms})
                continue
            atoms, at = self._order(kind, atoms, operands)
            first = self.slots([((k, 1.0),) for k in atoms])
            text = LOOPS[kind] if kind in LOOPS else f"f_{kind}({', '.join(f'{{{k}}}' for k in range(len(at)))})"
            for stretch in stretches(at):
                self._loop(at, first, stretch, text)

    def _order(self, kind: str, atoms: list[int], operands: dict[int, list[Row]]) -> tuple[list[int], list[list[int]]]:
        """Atoms of one kind and the places of their operands, in the order that makes fewer runs: as they come, or by places."""
        places = {k: [self.places[row] for row in operands[k]] for k in atoms}
        turned = {k: sorted(at) if kind == "mul" else at for k, at in places.items()}
        return fewest_runs([(order, by_operand(at[k] for k in order)) for at in (places, turned)
                             for order in (atoms, sorted(atoms, key=lambda k: at[k]))])

    def _loop(self, at: list[list[int]], first: int, stretch: Stretch, text: str, weights: Sequence[Sequence[float]] = ()) -> None:
        """v[first...) = `text` of the values at the places `at`, each times its weights: a call of a kernel that loops like it share."""
        start, stop, width, steps = stretch
        n, alone = stop - start, width == stop - start
        if n <= WRITTEN:
            factors = [list(map(self.constants.number, weight)) for weight in weights]
            self.lines += statements(at, factors, first, range(start, stop), text)
            return
        known, given = [], []
        for k, places in enumerate(at):
            if alone and width > 1:
                known.append((f"const real *RESTRICT p{k}", f"v + {places[start]}"))
                given.append(f"p{k}[{'i' if steps[k] else '0'}]")
                continue
            table = self.constants.table(places[start:stop:width], True)
            known.append((f"const {self.constants.kinds[table]} *RESTRICT p{k}", table))
            given.append(f"v[p{k}[i]]" if width == 1 else f"v[p{k}[r]{' + i' if steps[k] else ''}]")
        place = "i" if alone or width == 1 else f"{width}*r + i"
        for k, weight in enumerate(weights):
            parameter, factor = self.constants.weights(k, weight[start:stop], 1 if alone else width, place)
            known.append(parameter)
            given[k] = f"{factor}*{given[k]}"
        few = f"for (int i = 0; i < {width}; ++i)" if 1 < width <= FIXED else "for (int i = 0; i < n; ++i)"
        head = few if alone or width == 1 else f"for (int r = 0; r < n; ++r) {{ {few.replace('< n', f'< {width}')}"
        body = f"    (void)v; (void)n; {head} y[{place}] = {text.format(*given)};{'' if alone or width == 1 else ' ROW; }'}"
        if given == ["p0[i]"] and text == "f_sqrt({0})":
            body = "    (void)v; {at}roots(p0, y, n);"
        kernel = self.kernels.setdefault((", ".join(x for x, _ in known), body), f"{{at}}loop{len(self.kernels)}")
        count = n if alone or width == 1 else n // width
        self.lines.append(f"{kernel}(v, v + {first + start}, {count}, {', '.join(x for _, x in known)});")

    def _extremes(self, kind: str, atoms: Sequence[int], operands: dict[int, list[Row]]) -> None:
        """Statements for maxima or minima over several values."""
        sign = ">" if kind == "maxof" else "<"
        for k in atoms:
            table, first = self.constants.table([self.places[row] for row in operands[k]], True), self.slots([((k, 1.0),)])
            self.lines.append(f"{{ real s = v[{table}[0]]; for (int i = 1; i < {len(operands[k])}; ++i) s = v[{table}[i]] {sign} s ? "
                              f"v[{table}[i]] : s; v[{first}] = s; }}")


def table_program(program: Program, outputs: Sequence[Value], number: Any, prefix: str, name: str) -> tuple[list[str], str]:
    """Return the tables of a program as C, and the function {at}`name`(in, out) with what it calls; {at} begins each of their names."""
    planned, choice = rounds(program, list(outputs)), best_choice(program, outputs) or Choice(())
    made = Tables(program, ConstantTables(number, prefix), Places(last_uses(program, planned, outputs)), choice=choice,
                  alike=alike_rows(program, outputs, LONG))
    made.slots([((k, 1.0),) for k in range(program.n_inputs)])
    made.slots([((None, 1.0),)])
    for kinds in planned:
        made.round(kinds)
        made.memory.end_round()
    rows = [row_of(x) for x in outputs]
    made.sums(rows)
    begin = [f"real v[{made.memory.size}];", f"for (int i = 0; i < {program.n_inputs}; ++i) v[i] = in[i];",
             f"v[{program.n_inputs}] = R(1.0);"]
    products = [*(dense(*kind) for kind in sorted(made.products)), *(columns_product(*kind) for kind in sorted(made.column_products)),
                *(dots(*kind) for kind in sorted(made.dots))]
    loops = [f"static NOINLINE void {kernel}(const real *RESTRICT v, real *RESTRICT y, int n, {known}) {{\n{body}\n}}"
             for (known, body), kernel in made.kernels.items()]
    end = list(output_statements([made.places[row] for row in rows]))
    whole = "\n    ".join([f"static NOINLINE void {{at}}{name}(const real *in, real *out) {{", *begin, *made.lines, *end])
    return made.constants.tables, "\n".join([LANES, ROOTS, *products, *loops, f"{whole}\n}}", "#undef LANES"])
