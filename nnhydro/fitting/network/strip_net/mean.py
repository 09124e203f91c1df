"""The mean of several strip nets as one net that is as wide as all of them: chance in what a single one has learned falls out of it.

Neurons and states stand side by side, those of one net apart from the others'; the outputs are added at 1/n of their weights.
Source: Breiman (1996), Machine Learning 24, 123 (means of unstable choices).
"""

from collections.abc import Sequence
from dataclasses import replace

import torch
from torch import Tensor

from nnhydro.models.learned.strip_net import StripNet


def _apart(matrices: Sequence[Tensor], rows: Sequence[int], columns: Sequence[int]) -> Tensor:
    """One matrix of several: blocks of `rows` times `columns`, in each the nets on the diagonal; rows beyond them belong to all nets."""
    shared = matrices[0].shape[0] - sum(rows)
    parts = [[torch.split(part, list(columns), dim=1) for part in torch.split(matrix, [*rows, shared])] for matrix in matrices]

    def together(i: int, j: int) -> Tensor:
        """Return the blocks of a part of the rows and one of the columns."""
        blocks = [part[i][j] for part in parts]
        found: Tensor = torch.block_diag(*blocks) if i < len(rows) else torch.cat(blocks, dim=1)  # type: ignore[no-untyped-call]
        return found

    return torch.cat([torch.cat([together(i, j) for j in range(len(columns))], dim=1) for i in range(len(rows) + 1)])


def mean_of(nets: Sequence[StripNet]) -> StripNet:
    """Return the mean of `nets`, whose inputs have the same scales."""
    first, count = nets[0], len(nets)
    k, size = len(first.theta), first.inner.shape[1]

    def every(name: str) -> list[Tensor]:
        return [getattr(net, name) for net in nets]

    side_by_side = {name: torch.cat(every(name), dim=-1) for name in ("inner", "theta", "kappa", "even_bias", "place")}
    matrices = {"drive": _apart(every("drive"), [size], [k, k, k]), "gate": _apart(every("gate"), [size], [k, k]),
                "odd": _apart(every("odd"), [size, k, k, k], [size]), "even": _apart(every("even"), [k], [size]),
                "gate_bias": _apart([bias[None] for bias in every("gate_bias")], [], [k, k])[0], "out": torch.cat(every("out")) / count}
    return replace(first, **side_by_side, **matrices, **{name: torch.stack(every(name)).mean(dim=0) for name in ("skip", "plain", "body")})
