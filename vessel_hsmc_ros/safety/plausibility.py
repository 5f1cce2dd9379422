"""Jumps of the measured motion that no ship makes.

Between two samples a ship moves by at most V·dt and turns by at most V/(L/2)·dt, with a speed V that no ship of its length has:
V = 3·sqrt(g·L), a Froude number of 3. Measurement noise adds a margin of LENGTHS ship lengths and TURN.
"""

import math
from enum import Enum
from typing import NamedTuple

from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion, magnitude, wrap
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.safety.parameters import SafetyParameters

FROUDE = 3.0

LENGTHS, TURN = 2.0, 1.0
"""What noise may add: ship lengths, and rad."""


class Verdict(Enum):
    """What to do with a sample."""

    TAKE = "take"
    HOLD = "hold out"
    RELOCALISED = "take, and hand over"


class _Fix(NamedTuple):
    stamp: int
    motion: Motion


class Jumps:
    """Holds jumps out, until enough samples in a row agree on the new place.

    Args:
        parameters: Speed that no ship has, and number of samples.
        length: Of the ship, m.

    Attributes:
        held: Samples held out since the last one taken.
    """

    def __init__(self, parameters: SafetyParameters, length: float) -> None:
        chosen = parameters.jump_speed
        self._speed = FROUDE * math.sqrt(GRAVITY * length) if chosen < 0.0 else chosen
        self._length, self._samples = length, parameters.jump_samples
        self.reset()

    def reset(self) -> None:
        """Forget the last sample: the next is taken."""
        self._taken: _Fix | None = None
        self._candidate: _Fix | None = None
        self.held = 0

    def check(self, stamp: int, motion: Motion) -> Verdict:
        """Judge a sample by the last one taken.

        Args:
            stamp: ns, later than that of the last sample.
            motion: Finite.
        """
        fix = _Fix(stamp, motion)
        if self._taken is None or self._follows(self._taken, fix):
            self._take(fix)
            return Verdict.TAKE
        agrees = self._candidate is not None and self._follows(self._candidate, fix)
        self._candidate, self.held = fix, self.held + 1 if agrees else 1
        if self.held <= self._samples:
            return Verdict.HOLD
        self._take(fix)
        return Verdict.RELOCALISED

    def _take(self, fix: _Fix) -> None:
        self._taken, self._candidate, self.held = fix, None, 0

    def _follows(self, before: _Fix, after: _Fix) -> bool:
        """Whether a ship can have moved from one sample to the other, at a velocity that a ship can have."""
        a, b, dt = before.motion, after.motion, seconds(after.stamp - before.stamp)
        turning = 2.0 * self._speed / self._length
        moved = magnitude(b.x - a.x, b.y - a.y) <= LENGTHS * self._length + self._speed * dt
        turned = abs(wrap(b.psi - a.psi)) <= TURN + turning * dt
        return moved and turned and magnitude(b.u, b.v) <= self._speed and abs(b.r) <= turning
