"""Which samples of an input count, and when the last one has become too old.

A sample counts if it was received within T and is stamped within [now - T, now + T_future], later than the last one taken, in one
of its frames, finite, and with a covariance below its bound; one of zero is not known and counts. A message that names no frame
is taken to be in the right one. The frames of the first sample taken are those of all that follow: a localisation may publish
in `odom` and in `map`, which are not the same place. Times are integers in nanoseconds, so that the limits are exact.

Nor does a jump count that no ship makes. Between two samples a ship moves by at most V·dt and turns by at most V/(L/2)·dt, with a
speed V that no ship of its length has: V = 3·sqrt(g·L), a Froude number of 3. Measurement noise adds a margin of LENGTHS ship
lengths and TURN.
"""

import math
from collections import Counter
from collections.abc import Iterable
from enum import Enum
from typing import NamedTuple

from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters, SafetyParameters
from vessel_hsmc_ros.control.safety.reasons import Reason
from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion, magnitude, wrap
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds

REPEATED = (Reason.DUPLICATE, Reason.OUT_OF_ORDER)
"""Samples that a network may repeat or reorder are dropped and counted, and are no error."""


class Sample(NamedTuple):
    """What the checks take of a message."""

    stamp: int  # ns
    # frame, child_frame: of the message; empty where it names none
    frame: str
    child_frame: str
    values: tuple[float, ...]  # all of its numbers
    covariance: float = 0.0  # the largest variance of the position, m²; 0 where it is not known


class Freshness:
    """The freshness of one input.

    `timeout`: T, s. `frame`, `child_frame`: those that the input must have, one or several of which it has one; empty for any.

    Attributes:
        frames: The frames and child frames that are taken, each empty for any.
        refused: Number of refused samples by reason.
        last: Stamp of the last sample taken, ns; None before the first.
    """

    def __init__(
        self,
        timeout: float,
        parameters: FreshnessParameters,
        frame: str | Iterable[str] = (),
        child_frame: str | Iterable[str] = (),
    ) -> None:
        self.parameters = parameters
        self.timeout = round(timeout * NANOSECONDS)
        self._tolerance = round(parameters.future_tolerance * NANOSECONDS)
        self._allowed = several(frame), several(child_frame)
        self.refused: Counter[Reason] = Counter()
        self.reset()

    def reset(self) -> None:
        """Forget the last sample, as after the clock was set back; the counts go on."""
        self.last: int | None = None
        self.frames = self._allowed
        self._received = 0
        self._refusal = Reason.NONE, 0  # of the latest sample, unless that is a repetition, and when it was received

    def accept(self, sample: Sample, now: int, received: int) -> Reason:
        """Take a sample, or refuse and count it.

        `now`: ROS time, ns. `received`: time of its receipt, ns, on the clock of `overdue`. Returns NONE if it is taken, else
        why it is refused.
        """
        reason = self._check(sample, now)
        if reason:
            self.refused[reason] += 1
            if reason not in REPEATED:
                self._refusal = reason, received
        else:
            self.last, self._received, self._refusal = sample.stamp, received, (Reason.NONE, 0)
            self.narrow(several(sample.frame), several(sample.child_frame))
        return reason

    @property
    def narrowed(self) -> bool:
        """Whether a sample has decided which of several frames is taken."""
        return self.frames != self._allowed

    def narrow(self, frames: tuple[str, ...], child_frames: tuple[str, ...] = ()) -> None:
        """Take, of the allowed frames, these only from now on; none changes nothing."""
        pairs = zip((frames, child_frames), self.frames, strict=True)
        narrowed = [tuple(name for name in allowed if name in given) or allowed for given, allowed in pairs]
        self.frames = narrowed[0], narrowed[1]

    def overdue(self, now: int, received_now: int) -> Reason:
        """Whether the last sample taken still counts.

        `now`: ROS time, ns. `received_now`: the present time on the clock of its receipt, ns. Returns NONE, or why not:
        NOT_RECEIVED, OVERDUE, STAMP_OLD, STAMP_FUTURE, or why those that came since were refused.
        """
        refusal, refused_at = self._refusal
        if received_now - refused_at > self.timeout:
            refusal = Reason.NONE
        if self.last is None:
            return refusal or Reason.NOT_RECEIVED
        silence = received_now - self._received
        if silence > self.timeout:
            return refusal or Reason.OVERDUE
        reason = self._check_stamp(self.last, now)
        if reason is Reason.STAMP_OLD:  # mostly by silence, or by the delay with which the sample came
            return refusal or (Reason.OVERDUE if 2 * silence > self.timeout else reason)
        return reason

    def _check(self, sample: Sample, now: int) -> Reason:
        if self.parameters.frames_checked and not self._has_frames(sample):
            return Reason.WRONG_FRAME
        if not all(map(math.isfinite, sample.values)):
            return Reason.NOT_FINITE
        if not sample.covariance <= self.parameters.covariance_limit:
            return Reason.UNCERTAIN
        if reason := self._check_stamp(sample.stamp, now):  # first: what is too old is late, and no repetition
            return reason
        if self.last is not None and sample.stamp <= self.last:
            return Reason.DUPLICATE if sample.stamp == self.last else Reason.OUT_OF_ORDER
        return Reason.NONE

    def _check_stamp(self, stamp: int, now: int) -> Reason:
        if stamp < now - self.timeout:
            return Reason.STAMP_OLD
        return Reason.STAMP_FUTURE if stamp > now + self._tolerance else Reason.NONE

    def _has_frames(self, sample: Sample) -> bool:
        pairs = zip((sample.frame, sample.child_frame), self.frames, strict=True)
        return all(not (frame and allowed) or frame in allowed for frame, allowed in pairs)


def several(frame: str | Iterable[str]) -> tuple[str, ...]:
    """The frames of one name or of several, without empty ones."""
    return tuple(name for name in ((frame,) if isinstance(frame, str) else frame) if name)


FROUDE = 3.0

LENGTHS, TURN = 2.0, 1.0  # what noise may add: ship lengths, and rad


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

    `parameters`: speed that no ship has, and number of samples. `length`: of the ship, m.

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

        `stamp`: ns, later than that of the last sample. `motion`: finite.
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
