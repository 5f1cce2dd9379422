"""Rules for the measured motion: do velocities, heading and positions fit, and if not, in which unit or frame would they?

The rates of a motion follow from its positions and from its velocities. Each mistake is a hypothesis that undoes it. Where the
velocities contradict the positions, the one with which they fit best is named.
"""

import math
from collections.abc import Iterator

import numpy as np

from vessel_hsmc_ros.control.safety.monitors import DEVIATIONS, NAMED_BIAS, Compared, bias, block_length, explained
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.preflight.connection import OK, TODO, WRONG, Connection, Finding, Topic
from vessel_hsmc_ros.preflight.motion import (
    BLOCK,
    Complex,
    Mask,
    Rates,
    Samples,
    carried,
    means,
    motions_of,
    noises,
    parts,
    rates,
    sample_rate,
    slow,
    without_jumps,
)

LEAST_BLOCKS = 6
ERROR_SHARE = 0.3  # share of the velocity above which an error counts; knots are twice m/s
LONGEST_REPETITION = 2.0  # time for which a moving boat may have one and the same motion, s: that of a slow receiver
JUMP, JITTER = 0.3, 20.0
"""A position jumps where it moves on by this share of the ship's length and so many times the usual error of a step."""

NOISY_JUMP = 9.0  # declared deviations of a position that no noise exceeds from one sample to the next
BLURRED = 2.0  # deviations of the noise of blocks that are allowed for
LEAST_SPREAD, LARGEST_SPREAD = 0.1, 0.1
"""Circular variance of the difference of course and heading from which on the sense of the heading can be seen, and that of their
sum above which it is not constant."""

LARGEST_DRIFT, QUARTER, ASTERN, STEADY = 60.0, 25.0, 150.0, 0.8
"""Angle between course and heading that no turn makes, how far from a right angle it counts as one, and from where as astern,
deg; and the resultant above which it is always about the same."""

TURNED, ALIKE = 10.0, 0.95
"""Angle between velocities and positions that counts, deg, and the resultant above which it is always the same."""

SHOWN_BIAS = math.radians(10.0)  # least spread of a bias of the compass that is not known
KNOT, KM_PER_HOUR, MILE_PER_HOUR, FOOT = 1852.0 / 3600.0, 1.0 / 3.6, 0.44704, 0.3048
METRES_PER_DEGREE = 111_000.0

SPEEDS = {
    "are they in knots? They must be in m/s": (KNOT, 0),
    "are they in km/h? They must be in m/s": (KM_PER_HOUR, 0),
    "are they in miles per hour? They must be in m/s": (MILE_PER_HOUR, 0),
    "are they in feet per second? They must be in m/s": (FOOT, 0),
    "are the positions in mm? They must be in m": (1000.0, 0),
    "are the positions in cm? They must be in m": (100.0, 0),
    "are the positions in feet? They must be in m": (1.0 / FOOT, 0),
    "is v positive to starboard (FRD)? It must be FLU, to port": (0, 1),
    "is u positive astern? It must be FLU, ahead": (0, -1),
    "are they reversed, or is the heading off by 180 deg? It must be FLU, ahead and to port": (-1, 0),
    "does the heading count from north? It must be rad from east": (1j, 0),
    "is the heading off by 90 deg? It must be rad from east": (-1j, 0),
}
"""What may be wrong with w = u + i·v, and the factors a and b with which a·w + b·conj(w) undoes it."""

FRAMES = (
    ("is the twist in the frame of the pose? controller.odometry.twist_frame: parent is for that", -1j),
    ("are they along the hull already? controller.odometry.twist_frame: child is for that", 1j),
)
"""What may be wrong with the frame of w, and k with which w·exp(k·psi) undoes it; the second where the frame is parent."""

TURNS = {
    "is the yaw rate in degrees per second? It must be rad/s": math.radians(1.0),
    "is the heading in degrees? It must be rad": math.degrees(1.0),
    "is the yaw rate positive to starboard (FRD)? It must be FLU, to port": -1.0,
}
"""What may be wrong with r, and the factor that undoes it."""


def judge_motion(connection: Connection) -> Iterator[Finding]:
    """Findings on velocities, units, heading and their frames."""
    samples = motions_of(connection)
    if samples is None:
        return
    if repeated := judge_repetition(samples, connection.of("output", "command")):
        yield repeated
        return
    noise = noises(samples, connection.noise)
    samples, jumps = without_jumps(samples, JUMP * connection.length + NOISY_JUMP * noise[0], JITTER)
    if len(jumps):
        text = f"they jump, {len(jumps)} times, by {jumps.max():.3g} m at most, as those that are corrected now and then"
        yield Finding(WRONG, "positions", f"{text}: use the continuous odometry of the filter, in odom, not in map")
    moved, measured = rates(samples)
    if len(moved.r) < LEAST_BLOCKS - 1:
        yield Finding(TODO, "velocities", f"too few samples: it needs {LEAST_BLOCKS * BLOCK:g} s of state")
        return
    if in_degrees(samples, moved, measured, slow(connection.length)[0]):
        yield Finding(WRONG, "positions", "they look like latitude and longitude: they must be m in a plane, by navsat_odom_node")
        return
    yield from judge_velocities(connection, samples, moved, measured, noise)


def judge_velocities(
    connection: Connection, samples: Samples, moved: Rates, measured: Rates, noise: tuple[float, float]
) -> Iterator[Finding]:
    """That the velocities fit positions and heading, and the heading the courses.

    `moved`, `measured`: the motion by the positions and by the velocities. `noise`: standard deviations of a sample of the
    position, m, and of the heading, rad.
    """
    least, count = slow(connection.length), max(sample_rate(samples) * BLOCK, 1.0)
    blurred = noise[0] / math.sqrt(count), noise[1] / math.sqrt(count)  # deviations of the means of blocks
    spun = 0.5 * connection.length * np.abs(moved.r)  # a boat that turns on the spot heads nowhere
    fast = np.abs(moved.velocity) > np.maximum(2.0 * least[0] + BLURRED * blurred[0], spun)
    if (turned := mirrored_heading(moved, measured, fast)) is not None:
        yield Finding(WRONG, "heading", turned)
        return
    found = contradiction(moved, measured, least, blurred)
    if not found.known:
        speed = np.median(np.abs(moved.velocity))
        yield Finding(TODO, "velocities", f"the boat moves at {speed:.2g} m/s: check again while it sails turns")
        return
    if found.wrong and not (connection.uses_observer and not (samples.hull.any() or samples.r.any())):
        about = "yaw rate" if found.about else "velocities"
        yield Finding(WRONG, about, named(samples, moved, found.about, connection.twist_frame) or explained(found))
    else:
        yield judge_drift_angle(samples, moved, measured, fast, commanded_side(connection))
    yield from judge_compass(samples, connection.length)


def judge_repetition(samples: Samples, command: Topic | None) -> Finding | None:
    """That one and the same motion does not last for long under way or under a command."""
    t = samples.times
    changes = np.flatnonzero(np.any([np.diff(each) != 0.0 for each in samples[1:]], axis=0))
    first, last = np.concatenate(([0], changes + 1)), np.concatenate((changes, [len(t) - 1]))
    longest = int(np.argmax(t[last] - t[first]))
    at, begin, end = first[longest], float(t[first[longest]]), float(t[last[longest]])
    if samples.hull[at] or samples.r[at]:
        text = f"the same numbers for {end - begin:.3g} s under way: does the driver repeat its last message?"
        return Finding(WRONG, "velocities", text) if end - begin > LONGEST_REPETITION else None
    values = (
        [] if command is None else [command.columns[name] for name in ("force", "moment", "u", "r") if name in command.columns]
    )
    if command is None or not values:
        return None
    commanded = command.received[np.any(values, axis=0) & (command.received > begin) & (command.received < end)]
    if not len(commanded) or end - commanded[0] <= LONGEST_REPETITION:
        return None
    text = f"the boat has not moved at all for {end - commanded[0]:.3g} s under a command: does no command reach it, is it armed"
    return Finding(TODO, "velocities", f"{text}, or does the driver repeat its last message?")


def in_degrees(samples: Samples, moved: Rates, measured: Rates, least: float) -> bool:
    """Whether positions are latitude and longitude: they move a hundred-thousandth of the velocities."""
    speed, way = (float(np.median(np.abs(each.velocity))) for each in (measured, moved))
    ratio = way * METRES_PER_DEGREE / speed if speed > least else 0.0
    return 0.3 < ratio < 3.0 and bool(max(np.abs(samples.place.real).max(), np.abs(samples.place.imag).max()) <= 360.0)


def mirrored_heading(moved: Rates, measured: Rates, fast: Mask) -> str | None:
    """What is wrong where course and heading turn in opposite directions: their sum is constant, and not their difference."""
    if fast.sum() < LEAST_BLOCKS:
        return None
    velocity, psi = moved.velocity[fast], moved.psi[fast]
    course = velocity / np.abs(velocity)
    for part in parts(np.ones(len(psi))):
        spread, other = (1.0 - abs((course * np.exp(sign * 1j * psi))[part].mean()) for sign in (1.0, -1.0))
        if other < LEAST_SPREAD or other < 3.0 * spread or spread > LARGEST_SPREAD:
            return None
        if abs((velocity * np.exp(1j * psi))[part].mean()) < carried(psi[part]):
            return None
    if abs(np.angle((course * np.exp(1j * psi)).mean() * -1j)) < 0.6:
        agrees = float((moved.r * measured.r).sum()) > 0.0
        cause = "does the heading count clockwise from north (NED)"
        cause += ", or are positions x north and y east?" if agrees else "?"
    else:
        cause = "does it count clockwise (FRD)?"
    return f"course and heading turn in opposite directions: {cause} It must be x east, y north, heading counter-clockwise (ENU)"


def contradiction(moved: Rates, measured: Rates, least: tuple[float, float], noise: tuple[float, float]) -> Compared:
    """How the velocities differ from the positions, in all and in each half of the data in which the boat moves.

    `moved`, `measured`: the motion by the positions and by the velocities. `least`: speed and yaw rate below which nothing is
    concluded, m/s and rad/s. `noise`: standard deviations of the means of positions and headings over blocks, m and rad.
    """
    # Between neighbouring blocks the noise of positions partly cancels.
    velocity, r = ([0.5 * (each[1:] + each[:-1]) for each in pair] for pair in zip(moved[:2], measured[:2], strict=True))
    verdicts = [
        [differs(one[part], other[part], *limits) for part in parts(np.ones(len(one)))]
        for (one, other), *limits in zip((velocity, r), least, noise, strict=True)
    ]
    wrong = [bool(whole) and all(part is not False for part in each) for whole, *each in verdicts]
    about = 1 if wrong == [False, True] else 0
    one, other = (velocity, r)[about]
    worst = int(np.argmax(np.abs(one - other)))
    shown = [np.array([w[worst].real, w[worst].imag, turn[worst]]) for w, turn in zip(velocity, r, strict=True)]
    return Compared(shown[0], shown[1], any(wrong), any(whole is not None for whole, *_ in verdicts), about)


def differs(moved: Complex, measured: Complex, least: float, noise: float) -> bool | None:
    """Whether a velocity differs from that of the positions; None where the boat moves too slowly for a verdict."""
    fastest = max(rms(moved), rms(measured))
    if fastest <= 2.0 * least + BLURRED * noise:
        return None
    return rms(moved - measured) > ERROR_SHARE * fastest + least + BLURRED * noise


def rms(values: Complex) -> float:
    """Root mean square of numbers, complex ones by their size."""
    return float(np.sqrt((np.abs(values) ** 2).mean()))


def named(samples: Samples, moved: Rates, about: int, twist_frame: str) -> str:
    """The hypothesis that fits best, with numbers; empty if none does."""
    w = samples.hull
    if about:
        tried = {text: samples._replace(r=factor * samples.r) for text, factor in TURNS.items()}
    else:
        tried = {text: samples._replace(hull=a * w + b * w.conj()) for text, (a, b) in SPEEDS.items()}
        for text, k in FRAMES[: 2 if twist_frame == "parent" else 1]:
            tried[text] = samples._replace(hull=w * np.exp(k * samples.psi))

    def misfit(changed: Samples) -> float:
        return rms(moved[about] - rates(changed)[1][about])

    errors = {text: misfit(changed) for text, changed in tried.items()}
    best = min(errors, key=lambda text: errors[text])
    if errors[best] > ERROR_SHARE * rms(moved[about]) or errors[best] > 0.5 * misfit(samples):
        return ""
    return f"the measured {'yaw rate' if about else 'velocities'} and the positions differ: {best}"


def commanded_side(connection: Connection) -> int:
    """The sign of the mean of what has been commanded ahead or astern; 0 if nothing has."""
    command = connection.of("output", "command", "applied")
    columns = {} if command is None else command.columns
    ahead = columns.get("u", columns.get("force", np.zeros(1)))
    return int(np.sign(ahead.mean()))


def judge_drift_angle(samples: Samples, moved: Rates, measured: Rates, fast: Mask, side: int) -> Finding:
    """That a boat moves roughly where it heads, and by the velocities where it does by the positions."""
    if fast.sum() < LEAST_BLOCKS // 2:
        return Finding(OK, "velocities", "velocities fit the turns of the heading")
    psi = moved.psi[fast]
    ahead = moved.velocity[fast] * np.exp(-1j * psi)
    angle = math.degrees(np.angle(ahead.mean()))
    if abs(angle) > LARGEST_DRIFT and abs(ahead.mean()) > STEADY * np.abs(ahead).mean():
        return judge_direction(angle, off_course(ahead, psi), side)
    if samples.hull.real.any() and not samples.hull.imag.any():
        text = "v is 0 in all messages, as of wheels; a boat has sway, which controller.observer.enabled: true estimates"
        return Finding(TODO, "velocities", text)
    if abs(turned := angle_between(moved.velocity[fast], measured.velocity[fast])) > TURNED:
        side_of = "port" if turned < 0.0 else "starboard"
        text = f"the velocities point {abs(turned):.0f} deg to {side_of} of the way of the positions"
        cause = "a twist in the frame of the pose, a compass from magnetic north or turned, the course in place of the heading"
        correction = f"navsat_odom.heading_offset is larger by {math.radians(turned):.2f} then"
        return Finding(TODO, "heading", f"{text}: {cause}? {correction}")
    return Finding(OK, "velocities", f"they fit positions and heading, in m/s and rad/s; drift angle {angle:.0f} deg")


def judge_direction(angle: float, shown: bool, side: int) -> Finding:
    """What it means that a boat moves at a large angle, deg, to its heading, whether or not a current explains it."""
    text = f"the boat moves {angle:.0f} deg to port of its heading"
    offset = f"it must be rad from east, counter-clockwise (navsat_odom.heading_offset = {math.radians(angle):.2f} corrects it)"
    if side < 0 and abs(angle) > ASTERN:
        return Finding(OK, "velocities", "they fit positions and heading, in m/s and rad/s; the boat goes astern")
    if shown and abs(abs(angle) - 90.0) < QUARTER:
        return Finding(WRONG, "heading", f"{text}: does the heading count from north? {offset}")
    if shown and abs(angle) > ASTERN and side > 0:
        cause = "is it going astern, by reversed drives, or is the IMU mounted backwards? Then"
        return Finding(WRONG, "direction", f"{text} under a command ahead: {cause} {offset}")
    return Finding(TODO, "direction", f"{text}: by wind, current or drives, or is the heading off? Check while it sails turns")


def off_course(ahead: Complex, psi: Array) -> bool:
    """Whether a boat moves in another direction than it heads, in all and in each half of the data, and not by a current."""
    for part in parts(np.ones(len(psi))):
        mean = complex(ahead[part].mean())
        steady = abs(mean) > STEADY * float(np.abs(ahead[part]).mean())
        if not (steady and abs(math.degrees(np.angle(mean))) > LARGEST_DRIFT and abs(mean) > carried(psi)):
            return False
    return True


def angle_between(moved: Complex, measured: Complex) -> float:
    """The angle from the measured velocities to those of the positions, counter-clockwise, deg; 0 where it changes."""
    turns = moved * measured.conj()
    size = float(np.abs(turns).sum())
    return math.degrees(np.angle(turns.sum())) if abs(turns.sum()) > ALIKE * size > 0.0 else 0.0


def judge_compass(samples: Samples, length: float) -> Iterator[Finding]:
    """Whether the heading fits the courses of the boat, whatever the current; nothing where the courses do not show it."""
    t = samples.times
    columns = np.column_stack((t - t[0], samples.place.real, samples.place.imag, samples.psi))
    found = bias(means(t, columns, block_length(length)), length)
    if found is None or not (found.lost or DEVIATIONS * found.deviation < SHOWN_BIAS):
        return
    if found.lost:
        yield Finding(WRONG, "compass", f"{found.text()}: does it stand still, or is it of another time?")
    elif found.beyond > NAMED_BIAS:
        cause = "magnetic north, metal near it, or turned in its mount"
        change = f"add {-found.angle:.2f} to navsat_odom.heading_offset, or correct the driver"
        yield Finding(WRONG, "compass", f"{found.text()}: {cause}? {change}")
    else:
        yield Finding(OK, "compass", f"it fits the courses of the boat: {found.text()}")
