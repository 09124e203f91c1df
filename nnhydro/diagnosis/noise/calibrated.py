"""The noise beside the unknown alone, the unknown's sizes, and the baseline calibrated so."""

from nnhydro.diagnosis.model.evidence import WhiteRows
from nnhydro.diagnosis.model.sizes import Sizes, fit_sizes
from nnhydro.diagnosis.model.unknown import Unknown
from nnhydro.diagnosis.noise.spectrum import Noise, first_noise, reestimate
from nnhydro.diagnosis.problem.design import Design
from nnhydro.models.strip_theory import StripTheory

FIRST_SIZE = 0.1  # of the unknown, from which its sizes are climbed
NOISE_ROUNDS = 3


def calibrated_noise(design: Design, unknown: Unknown) -> tuple[Noise, WhiteRows, Sizes, StripTheory]:
    """Return the noise beside the unknown alone, the rows whitened by it, the unknown's sizes, and the baseline calibrated so.

    The rows keep the smooth unknown; the constant of steady tables serves the noise alone.
    """
    noise, sizes = first_noise(design), None
    for _ in range(NOISE_ROUNDS):
        whitened = WhiteRows(design, unknown, noise.v)
        _, sizes = fit_sizes(whitened, None, Sizes.even(whitened, FIRST_SIZE) if sizes is None else sizes)
        noise = reestimate(design, noise, whitened, None, sizes.vector(whitened))
    whitened = WhiteRows(design, unknown.smooth, noise.v)
    assert sizes is not None
    fit, sizes = fit_sizes(whitened, None, Sizes(sizes.tau[:, : len(whitened.unknown.names)]))
    return noise, whitened, sizes, design.baseline.at(design.baseline.within(fit.mean[: whitened.p]))
