"""Torques that keep one value in a whole recording, while the arm moves: a command held on purpose, or a channel that is dead.

What the same channel does in the other recordings tells which: a sensor changes from row to row, a command keeps its values.
"""

from collections.abc import Iterator

from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import CampaignCheck, Oddity, check
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.checks.stuck_channels import COMMANDED, MOVES, is_command, is_constant
from nnhydro.recordings.filtering.preprocessing import Preparation


@check
class ConstantTorque(CampaignCheck):
    """A torque is constant in all recordings of a moving arm, as a command may be, or in none."""

    id = "constant_torque"
    looks_for = "a torque that keeps exactly one value in a whole recording while the arm moves"
    remedy = ("the torque channel was dead in this recording: record again or move the file out of recordings/; right only if it is a "
              "command that was held on purpose")

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield a finding for each constant channel: a warning where most other recordings measure it, else a note."""
        found, others, measured = list[tuple[int, str, str]](), [0] * campaign.arm.n_links, [0] * campaign.arm.n_links
        for recording in campaign.recordings():
            reading = Reading.of(recording, campaign.arm)
            for joint, x in enumerate(() if reading.recording.tau is None else reading.recording.tau.T):
                if is_constant(x) and reading.moved.max() > MOVES:
                    found.append((joint, reading.name, f"keeps exactly {x[0]:.4g} N m in the whole recording while the arm moves by "
                                                       f"{reading.moved.max():.2g} rad"))
                else:
                    others[joint] += 1
                    measured[joint] += not is_command(x)
        for joint, name, what in found:
            dead = 2 * measured[joint] > others[joint]
            more = f", and changes from row to row in {measured[joint]} of {others[joint]} others" if dead else ""
            yield Oddity(name, "warning" if dead else "note", campaign.arm.column("tau", joint + 1), what + more,
                         self.remedy if dead else COMMANDED)
