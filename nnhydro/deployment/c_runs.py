"""In which order the values of one operation are computed: so that its operands lie side by side, in few and long runs.

A run is a stretch in which every list of places stands still or goes on by one. Runs that go on are looked for first: what lies strip
beside strip is read, a vector of the processor at a time, by whatever comes next.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from heapq import heapify, heappop, heappush
from itertools import groupby, product
from operator import add, sub
from typing import Any, Final

RUN: Final = 4  # places that follow each other, a vector of the processor: shorter runs go one by one
VECTOR: Final = 8  # numbers of the processor's widest vector
ALL_STEPS: Final = 4  # operands: of more, only runs in which all go on are looked for

Stretch = tuple[int, int, int, tuple[int, ...]]  # start, stop, width, by how much each list goes on within a width: 0 or 1


def runs(at: list[list[int]]) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Lengths of the runs in which each list of places stands still or goes on by one, and which it does."""
    n, start = len(at[0]), 0
    onward = list(zip(*(list(map(sub, places[1:], places)) for places in at), strict=True))
    alike = {steps: set(steps) <= {0, 1} for steps in set(onward)}
    while start < n:
        first = onward[start] if start + 1 < n else ()
        stop = start + 1
        while first and alike[first] and stop < n and onward[stop - 1] == first:
            stop += 1
        yield (stop - start, first) if stop - start >= RUN else (1, ())
        start = stop if stop - start >= RUN else start + 1


def _stretches(lengths: Iterable[tuple[int, tuple[int, ...]]]) -> list[Stretch]:
    """The stretches that runs make."""
    found: list[Stretch] = []
    start = 0
    for (width, steps), group in groupby(lengths):
        stop = start + width * len(list(group))
        found.append((start, stop, width, steps))
        start = stop
    return found


def stretches(at: list[list[int]]) -> list[Stretch]:
    """Cut lists of places into stretches of equal runs."""
    return _stretches(runs(at))


def by_operand(places: Iterable[Sequence[Any]]) -> list[list[Any]]:
    """What belongs to each operand, from what belongs to each atom."""
    return [list(slot) for slot in zip(*places, strict=True)]


def _alike_together(order: Sequence[Any], at: list[list[int]]) -> tuple[list[Any], list[list[int]]]:
    """The same atoms and their places with all runs of one kind behind each other."""
    lengths, starts = list(runs(at)), [0]
    for width, _ in lengths:
        starts.append(starts[-1] + width)
    first = {kind: k for k, kind in reversed(list(enumerate(lengths)))}
    chosen = [i for k in sorted(range(len(lengths)), key=lambda k: first[lengths[k]]) for i in range(starts[k], starts[k + 1])]
    return [order[i] for i in chosen], [[places[i] for i in chosen] for places in at]


def _successors(points: Sequence[tuple[int, ...]], step: tuple[int, ...]) -> dict[int, int]:
    """Which point follows each by `step`; of equal points, the first one follows the first one."""
    found, seen = dict[tuple[tuple[int, ...], int], int](), defaultdict[tuple[int, ...], int](int)
    ranks = []
    for k, point in enumerate(points):
        ranks.append(seen[point])
        found[point, seen[point]] = k
        seen[point] += 1
    ahead = ((k, found.get((tuple(map(add, point, step)), ranks[k]))) for k, point in enumerate(points))
    return {k: other for k, other in ahead if other is not None}


def _longest_first(order: Sequence[Any], at: list[list[int]]) -> tuple[list[Any], list[list[int]]]:
    """The same atoms and their places in the longest runs that can be made of them, one after the other."""
    points = list(zip(*at, strict=True))
    steps = [step for step in product((0, 1), repeat=len(at)) if any(step)] if len(at) <= ALL_STEPS else [(1,) * len(at)]
    after = [_successors(points, step) for step in steps]
    free, waiting = set(range(len(points))), [(-length, n, k) for n, ahead in enumerate(after) for k, length in _heads(ahead, points)]
    chains: list[tuple[int, int, list[int]]] = []
    heapify(waiting)
    while waiting:
        claimed, n, k = heappop(waiting)
        chain = list(_walk(after[n], k, free))
        if len(chain) < RUN:
            continue
        if len(chain) < -claimed:
            heappush(waiting, (-len(chain), n, k))
            continue
        free -= set(chain)
        chains.append((-len(chain), n, chain))
        for m, ahead in enumerate(after):
            for other in (ahead[i] for i in chain if ahead.get(i) in free):
                heappush(waiting, (-len(list(_walk(ahead, other, free))), m, other))
    chosen = [i for *_, chain in sorted(chains) for i in chain] + sorted(free)
    return [order[i] for i in chosen], [[places[i] for i in chosen] for places in at]


def _walk(ahead: dict[int, int], start: int | None, free: set[int]) -> Iterator[int]:
    """The points that follow each other from `start` on, as long as they are free."""
    while start is not None and start in free:
        yield start
        start = ahead.get(start)


def _heads(ahead: dict[int, int], points: Sequence[Any]) -> Iterator[tuple[int, int]]:
    """Points that follow none, and how many follow each other from there on."""
    free = set(range(len(points)))
    for k in free - set(ahead.values()):
        yield k, len(list(_walk(ahead, k, free)))


def fewest_runs(orders: Sequence[tuple[list[Any], list[list[int]]]]) -> tuple[list[Any], list[list[int]]]:
    """Of several orders of the same atoms, each with its places, the one that makes fewest loops and, of these, fewest runs."""
    return min([*orders, *(_alike_together(*order) for order in orders), _longest_first(*orders[0])], key=_cost)


def _cost(order: tuple[list[Any], list[list[int]]]) -> tuple[int, int]:
    """Loops and vectors, and of as many the fewest places that stand still: what goes on lies strip beside strip for its readers too."""
    lengths = list(runs(order[1]))
    vectors = sum(-(-width // VECTOR) for width, _ in lengths)
    return 4 * len(_stretches(lengths)) + vectors, sum(width * steps.count(0) for width, steps in lengths)


def statements(at: list[list[int]], weights: Sequence[Sequence[str]], first: int, numbers: range, text: str) -> Iterator[str]:
    """Yield v[first + i] = `text` of the values at the places `at`, each times its weights where there are any, for i in `numbers`."""
    for i in numbers:
        values = [f"v[{places[i]}]" for places in at]
        yield f"v[{first + i}] = {text.format(*([f'{c[i]}*{x}' for c, x in zip(weights, values, strict=True)] if weights else values))};"


def output_statements(places: list[int]) -> Iterator[str]:
    """Yield the statements that give out what lies at `places`."""
    start = 0
    for width, steps in runs([places]):
        at = f"{places[start]}{' + i' if all(steps) else ''}"
        yield f"out[{start}] = v[{places[start]}];" if width == 1 else f"for (int i = 0; i < {width}; ++i) out[{start} + i] = v[{at}];"
        start += width
