"""Which samples of an input count, and when the last one has become too old.

A sample counts if it was received within T and is stamped within [now - T, now + T_future], later than the last one taken,
in one of its frames, with numbers that a vessel on Earth can have, and with a covariance below its bound; one of zero is
not known, and counts. A message that names no frame is taken to be in the right one. The frames of the first sample taken
are those of all that follow: a localisation may publish in `odom` and in `map`, which are not the same place. Times are
integers in nanoseconds, so that the limits are exact.

Nor does a jump count that no ship makes. Between two samples a ship moves by at most V·dt and turns by at most V/(L/2)·dt, with a
speed V that no ship of its length has: V = 3·sqrt(g·L), a Froude number of 3. Measurement noise adds a margin of LENGTHS ship
lengths and TURN.

Riding through a lost position: for a declared time the last place moves on by the velocities, along the measured heading.

    (x, y)' = R(psi)(u, v),    trapezoidal between two measurements

It needs measurements that go on to come, with a heading, while their position is NaN. The error of the place grows with that of
the velocities: with 0.1 m/s it is 1 m after 10 s.

Why a controller must not be enabled although its inputs are good: another ship's data, or too far away.
"""

import math
import sys
from collections import Counter
from collections.abc import Collection, Iterable
from enum import Enum
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters, Reason, SafetyParameters
from vessel_hsmc_ros.core.fence import Fence, allowed, clearance
from vessel_hsmc_ros.core.hull import another_ship, kept
from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion, magnitude, to_body, wrap
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds

LARGEST = 1e8
"""Largest absolute value of a number in a motion, SI: from any place on Earth a law comes back, from 1e30 m it does not."""

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
    `largest`: the largest absolute value of a number.

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
        largest: float = sys.float_info.max,
    ) -> None:
        self.parameters, self._largest = parameters, largest
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

        `received`: time of its receipt, ns, on the clock of `overdue`. Returns NONE if it is taken, else why it is refused.
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
        if not all(abs(value) <= self._largest for value in sample.values):
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
        """Judge a sample by the last one taken. `stamp`: ns, later than that of the last sample. `motion`: finite."""
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


class DeadReckoning:
    """Fills in the position of measurements that lack it.

    `limit`: longest time without a position, s; 0: never.

    Attributes:
        elapsed: Time since the last measured position, s; 0 while there is one.
    """

    def __init__(self, limit: float) -> None:
        self._limit = round(limit * NANOSECONDS)
        self.reset()

    def reset(self) -> None:
        """Forget the last place."""
        self.elapsed = 0.0
        self._known: int | None = None
        self._last: tuple[int, Motion] | None = None

    def fill(self, stamp: int, motion: Motion, estimate: Motion | None = None) -> Motion:
        """The measurement of a time, ns, with a position where it lacks one and that may be bridged; else as it is.

        `estimate`: the motion by an observer, whose velocities count; None without one. Velocities that are lost as well stay
        those of before.
        """
        if math.isfinite(motion.x) and math.isfinite(motion.y):
            self._known, self._last, self.elapsed = stamp, (stamp, motion), 0.0
            return motion
        if self._last is None or self._known is None or not math.isfinite(motion.psi):
            return motion
        if not self._last[0] < stamp <= self._known + self._limit:
            return motion
        before = self._last[1]
        source = estimate or motion
        velocities = (source.u, source.v, source.r)
        u, v, r = velocities if all(map(math.isfinite, velocities)) else (before.u, before.v, before.r)
        filled = Motion(before.x, before.y, motion.psi, u, v, r)
        dt = 0.5 * seconds(stamp - self._last[0])
        (x_0, y_0), (x_1, y_1) = (to_body(m.u, m.v, -m.psi) for m in (before, filled))
        filled = filled._replace(x=before.x + dt * (x_0 + x_1), y=before.y + dt * (y_0 + y_1))
        self._last, self.elapsed = (stamp, filled), seconds(stamp - self._known)
        return filled


MAX_LENGTHS = 100.0  # distance of a reference that no one means, in lengths of the vessel, where no parameter sets it


def hull_problem(vessel: object, given: Collection[str]) -> str:
    """Why a vessel is not that of whoever started the controller; empty if it may be.

    `given`: the dotted names of all parameters that the controller was given.
    """
    papers = {name: text for name, text in kept(vessel).items() if f"vessel.{name}" not in given}
    if another_ship(vessel):
        remaining = ", ".join(f"vessel.{text}" for text in papers.values())
        return f"only a part of the hull is given, of the paper's ship remain {remaining}: give these too" if papers else ""
    if papers and not any(f"vessel.{name}" in given for name in kept(type(vessel)())):
        return (
            "no parameter describes the vessel: give its hull data, as a file of `vessel-hsmc init` has them, or"
            " vessel:=paper_ship for the default ship"
        )
    return ""


def fence_problem(own: Motion, fence: Fence | None) -> str:
    """Why a vessel that is outside of its fence is not to be steered; empty if it is inside, or there is no fence."""
    place = complex(own.x, own.y)
    if fence is None or allowed(fence, place):
        return ""
    outside = -clearance(fence, np.array([place, place]))
    return f"the vessel at ({own.x:.6g}, {own.y:.6g}) m is {outside:.1f} m outside of safety.fence: steer it inside by hand"


def distance_problem(own: Motion, reference: Motion, length: float, limit: float) -> str:
    """Why a reference is not meant for a vessel where it is; empty if it may be.

    `own`: measured motion. `length`: of the vessel, m. `limit`: largest distance, m; negative for MAX_LENGTHS.
    """
    largest = MAX_LENGTHS * length if limit < 0.0 else limit
    distance = math.hypot(reference.x - own.x, reference.y - own.y)
    if distance <= largest:
        return ""
    return (
        f"the reference at ({reference.x:.6g}, {reference.y:.6g}) m is {distance:.6g} m from the vessel at"
        f" ({own.x:.6g}, {own.y:.6g}) m, and must be within safety.enable_distance = {largest:g} m: are both in one frame?"
    )
