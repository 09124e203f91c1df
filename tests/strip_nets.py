"""Hybrids that hold a memory of the strips, with weights that nobody trained."""

from dataclasses import fields, replace

import torch
from rigs import run

from nnhydro.models.learned.strip_inputs import EVEN, PLAIN, arm_columns
from nnhydro.models.learned.strip_net import StripNet
from nnhydro.physics.flow import Flow

ODD, SIZE = 9, 16


def net(a, seed=0):
    """A net of random weights."""
    generator, k = torch.Generator().manual_seed(seed), SIZE // 2

    def n(*shape):
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    one = torch.ones(EVEN, dtype=torch.float64)
    return StripNet(0.5 + n(ODD).abs(), n(EVEN), 1 + one, -one, 3 * one, one[:1], n(ODD - 1, SIZE), n(SIZE, 3 * k),
                    n(SIZE + 1, 2 * k), n(2 * k), n(k), n(k), n(SIZE + 3 * k + 1, SIZE), n(k + 1, SIZE), n(SIZE), n(SIZE, 1),
                    0.3 * n(EVEN - 1, SIZE), n(ODD, 1), n(PLAIN),
                    n(arm_columns(Flow(a, run(a.n_links))).shape[2]))


def remembering(hybrid):
    """The hybrid with such a net, used in unlike shares."""
    water = net(hybrid.arm)
    small = replace(water, out=0.05 * water.out, skip=0.05 * water.skip, plain=0.1 * water.plain, body=0.02 * water.body)
    return replace(hybrid, water=small, share=torch.linspace(0.4, 0.7, hybrid.arm.n_links, dtype=torch.float64))


def single(water):
    """The net in single precision, as it is trained."""
    return StripNet(*(getattr(water, f.name).float() for f in fields(water)))
