"""The truth of a recipe as a concealed world: an arm of the blind tests with what it hides, simulated by their own code.

    truth: {concealed: {effect: link_interference, links: 2, size: small, seed: 3, index: 0}}

The arm and what it hides are those of campaign `index` of `nnhydro conceal` with the same choices; motions, controller, sensors and the
seed of chance are the recipe's. arm.yaml holds the arm as it is stated, without what it hides.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from pydantic import Field

from nnhydro.blind_tests.conceal import UNSHOWN, check_request
from nnhydro.blind_tests.truth.campaign import MORNING, NotVisibleError, Wish, World, draw_world
from nnhydro.blind_tests.truth.tank import read
from nnhydro.blind_tests.truth.world import TrueRun
from nnhydro.errors import ConfigError, require
from nnhydro.recordings.arm import Arm, parse_arm
from nnhydro.recordings.readers.validation import Settings
from nnhydro.simulation.concealed_arm import ConcealedArm, is_affine, steps
from nnhydro.simulation.motions.motion_kind import Reference, State
from nnhydro.simulation.native_loop import track
from nnhydro.simulation.run import Run, grid, stream
from nnhydro.simulation.torque_law import TorqueLaw

KEY = "truth.concealed"
MAX_ROWS = 200_000  # of the fine grid of one run: about 2 GB, for the strips of a whole run are computed side by side
PAUSE = 240.0  # s of the day between one recording and the next
FOLLOW = "use 'controller: none', where the arm follows its motions exactly"


class ConcealedKeys(Settings):
    """What is hidden and in which arm: the choices of `nnhydro conceal`, by the same names."""

    effect: str = Field(max_length=100)
    strength: str = Field(default="strong", max_length=20)
    links: int | None = None
    effects: int = 1
    size: str = Field(default="normal", max_length=20)
    seed: int = Field(default=0, ge=0, lt=2**63)
    index: int = Field(default=0, ge=0, le=998)


class TruthKeys(Settings):
    """A truth that is neither terms nor a model."""

    concealed: ConcealedKeys


@final
@dataclass(frozen=True, eq=False)
class ConcealedTruth:
    """A concealed world as the truth of a recipe; `seed` is the recipe's, from which each run's chance follows."""

    world: World
    arm: Arm  # as stated
    seed: int

    def require_possible(self, references: Mapping[str, Reference], rate_hz: float, controlled: bool, where: str) -> None:
        """Raise ConfigError naming `where` and the key where a run is too long, or cannot be stepped under a controller."""
        for name, reference in references.items():
            rows = len(grid(reference, rate_hz))
            require(rows <= MAX_ROWS, f"{where}: motion {name!r}: {rows} steps are too many for a concealed world, which takes up to "
                    f"{MAX_ROWS}: shorten it, or lower sample_rate_hz or substeps")
        if not controlled:
            return
        require(all(cause.drive is None for cause in self.world.causes), f"{where}: {KEY}: what this arm hides lies between drive and "
                f"link. The controller would see the drive, whose motion is not stepped: {FOLLOW}")
        require(steps(self.world), f"{where}: {KEY}: what this arm hides depends on the motion before, or on the length of "
                f"the run. A simulation under a controller cannot step through it: {FOLLOW}")

    def runs(self, references: Mapping[str, Reference], law: TorqueLaw | None, rate_hz: float, hold: int) -> Iterator[Run]:
        """Yield a run a reference as drives and sensors of the arm read it, without the recipe's sensors.

        Without `law` the links follow the references exactly; with it, which acts every `hold` steps of 1/`rate_hz` s, they obey the
        truth's equation of motion. Raises ConfigError where the arm runs away, ModelError where no acceleration gives a torque.
        """
        start = MORNING
        for name, reference in references.items():
            if law is None:
                state = reference.at(grid(reference, rate_hz))
            else:
                state = track(name, reference, self.loop_arm(name, start), law, rate_hz, hold).state
            yield self._read(self._run(name, state, rate_hz, start), rate_hz)
            start += round(reference.duration + PAUSE, 1)

    def loop_arm(self, name: str, start: float = MORNING) -> ConcealedArm:
        """Return the arm for the control loop of the run `name`, which begins at the time of day `start` s."""
        still = np.zeros((1, self.arm.n_links))
        return ConcealedArm(self.world, self._run(name, State(still, still, still, still[:, 0], still[:, 0]), 1.0, start), self.affine)

    @cached_property
    def affine(self) -> bool:
        """Whether the joint torques are affine in the acceleration."""
        return is_affine(self.world)

    def _run(self, name: str, state: State, rate_hz: float, start: float) -> TrueRun:
        chance = int(stream(self.seed, name, "truth").integers(2**31))
        return TrueRun(name, np.arange(len(state.u0)) / rate_hz, *state, start, chance)

    def _read(self, run: TrueRun, rate_hz: float) -> Run:
        """What the drives' encoders and the torque sensors read of a run; torques as at the joints."""
        seen = read(run, self.world.arm, self.world.causes)
        tau = np.column_stack([seen.tau.sum(axis=1), seen.tau[:, 1]]) if self.world.arm.belt else seen.tau
        return Run(run.name, rate_hz, State(seen.q, seen.qd, seen.qdd, run.u0, run.du0), tau, run.start)


def concealed_truth(keys: ConcealedKeys, seed: int, where: str) -> ConcealedTruth:
    """Return the concealed world that `keys` ask for; raise ConfigError naming `where` and the key where it cannot be made."""
    wish = Wish(keys.effect, keys.strength, keys.links, keys.effects, keys.size)
    try:
        check_request(wish, 1, keys.seed, f"{KEY}.")
        world = draw_world(keys.seed, keys.index, wish)
    except ConfigError as cause:
        raise ConfigError(f"{where}: {cause}") from cause
    except NotVisibleError as cause:
        raise ConfigError(f"{where}: {KEY}.effect {cause}: {UNSHOWN}") from cause
    return ConcealedTruth(world, parse_arm(world.stated, f"{where}: {KEY}"), seed)
