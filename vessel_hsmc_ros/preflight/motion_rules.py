"""Rules for the measured motion: do velocities, heading and positions fit, and if not, in which unit or frame would they?

The rates of a motion follow from its positions and from its velocities. Each mistake is a hypothesis that undoes it. Where the
velocities contradict the positions, the one with which they fit best is named.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np

from vessel_hsmc_ros.control.safety.monitors import DEVIATIONS, NAMED_BIAS, SLOW_SPEED, Compared, bias, block_length, explained
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.preflight.connection import (
    BLOCK,
    OK,
    TODO,
    WRONG,
    Connection,
    Finding,
    Samples,
    Topic,
    along_hull,
    carried,
    headings,
    means,
    motions_of,
    noises,
    rates,
    sample_rate,
    without_jumps,
)


def repetition(samples: Samples, command: Topic | None) -> tuple[float, bool]:
    """The longest time, s, of one and the same motion under way or under a command, and whether that is under way."""
    t, motions = samples
    changes = np.flatnonzero((np.diff(motions, axis=0) != 0.0).any(axis=1))
    first, last = np.concatenate(([0], changes + 1)), np.concatenate((changes, [len(t) - 1]))
    longest = int(np.argmax(t[last] - t[first]))
    begin, end = float(t[first[longest]]), float(t[last[longest]])
    if motions[first[longest], 3:].any():
        return end - begin, True
    columns = {} if command is None else command.columns
    values = [column for name, column in columns.items() if name in ("force", "moment", "u", "r")]
    if command is None or not values:
        return 0.0, False
    commanded = np.any(values, axis=0) & (command.received > begin) & (command.received < end)
    return (end - float(command.received[commanded][0]) if commanded.any() else 0.0), False


LEAST_BLOCKS = 6

ERROR_SHARE = 0.3  # share of the velocity above which an error counts; knots are twice m/s
LEAST_SPREAD = 0.1
"""Circular variance of the difference of course and heading from which on the sense of the heading can be seen."""

LARGEST_SPREAD = 0.1  # circular variance above which a sum of course and heading is not constant
LONGEST_REPETITION = 2.0  # time for which a moving boat may have one and the same motion, s: that of a slow receiver
JUMP, JITTER = 0.3, 20.0
"""A position jumps where it moves on by this share of the ship's length and so many times the usual error of a step."""

NOISY_JUMP = 9.0  # declared deviations of a position that no noise exceeds from one sample to the next
BLURRED = 2.0  # deviations of the noise of blocks that are allowed for
LARGEST_DRIFT, QUARTER, ASTERN, STEADY = 60.0, 25.0, 150.0, 0.8
"""Angle between course and heading that no turn makes, how far from a right angle it counts as one, and from where as astern,
deg; and the resultant above which it is always about the same."""

TURNED, ALIKE = 10.0, 0.95
"""Angle between velocities and positions that counts, deg, and the resultant above which it is always the same."""

KNOT, KM_PER_HOUR, MILE_PER_HOUR, FOOT = 1852.0 / 3600.0, 1.0 / 3.6, 0.44704, 0.3048

METRES_PER_DEGREE = 111_000.0


def judge_motion(connection: Connection) -> Iterator[Finding]:
    """Findings on velocities, units, heading and their frames."""
    samples = motions_of(connection)
    if samples is None:
        return
    still, moving = repetition(samples, connection.of("output", "command"))
    if still > LONGEST_REPETITION:
        yield judge_repetition(still, moving)
        return
    noise = noises(samples, connection.noise)
    samples, jumps = without_jumps(samples, JUMP * connection.length + NOISY_JUMP * noise[0], JITTER)
    if len(jumps):
        text = f"they jump, {len(jumps)} times, by {jumps.max():.3g} m at most, as those that are corrected now and then"
        yield Finding(WRONG, "positions", f"{text}: use the continuous odometry of the filter, in odom, not in map")
    slow = SLOW_SPEED * math.sqrt(GRAVITY * connection.length)
    moved, measured = rates(samples)
    if len(moved) < LEAST_BLOCKS - 1:
        yield Finding(TODO, "velocities", f"too few samples: it needs {LEAST_BLOCKS * BLOCK:g} s of state")
        return
    blurred = np.array(noise) / math.sqrt(max(sample_rate(samples) * BLOCK, 1.0))  # deviations of the means of blocks
    if in_degrees(samples, moved, measured, slow):
        yield Finding(WRONG, "positions", "they look like latitude and longitude: they must be m in a plane, by navsat_odom_node")
        return
    spun = 0.5 * connection.length * np.abs(moved[:, 2])  # a boat that turns on the spot heads nowhere
    fast = np.linalg.norm(moved[:, :2], axis=1) > np.maximum(2.0 * slow + BLURRED * float(blurred[0]), spun)
    if (turned := mirrored_heading(samples, moved, measured, fast)) is not None:
        yield Finding(WRONG, "heading", turned)
        return
    found = contradiction(moved, measured, (slow, slow / connection.length), (float(blurred[0]), float(blurred[1])))
    if not found.known:
        speed = np.median(np.linalg.norm(moved[:, :2], axis=1))
        yield Finding(TODO, "velocities", f"the boat moves at {speed:.2g} m/s: check again while it sails turns")
    elif found.wrong and not (connection.uses_observer and not samples.motions[:, 3:].any()):
        about = "yaw rate" if found.about else "velocities"
        yield Finding(WRONG, about, named(samples, moved, found.about, connection.twist_frame) or explained(found))
    else:
        yield from judge_drift_angle(samples, moved, measured, fast, commanded_side(connection))
    if found.known:
        yield from judge_compass(samples, connection.length)


SHOWN_BIAS = math.radians(10.0)  # least spread of a bias that is not known


def judge_compass(samples: Samples, length: float) -> Iterator[Finding]:
    """Whether the heading fits the courses of the boat, whatever the current; nothing where the courses do not show it."""
    t, motions = samples
    columns = np.column_stack((t - t[0], motions[:, :2], np.unwrap(motions[:, 2])))
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


def judge_repetition(still: float, moving: bool) -> Finding:
    """What it means that all numbers are the same for a time, s."""
    if moving:
        return Finding(
            WRONG, "velocities", f"the same numbers for {still:.3g} s under way: does the driver repeat its last message?"
        )
    text = f"the boat has not moved at all for {still:.3g} s under a command: does no command reach it, is it armed"
    return Finding(TODO, "velocities", f"{text}, or does the driver repeat its last message?")


def contradiction(moved: Array, measured: Array, slow: tuple[float, float], noise: tuple[float, float]) -> Compared:
    """How the velocities differ from the positions, in all and in each half of the data in which the boat moves.

    `moved`, `measured`: rates of x, y and psi by the positions and by the velocities, (m, 3). `slow`: speed and yaw rate below
    which nothing is concluded, m/s and rad/s. `noise`: standard deviations of the means of positions and headings over blocks,
    m and rad.
    """
    smooth = 0.5 * (moved[1:] + moved[:-1]), 0.5 * (measured[1:] + measured[:-1])  # the noise of positions partly cancels
    half = len(smooth[0]) // 2
    whole, *parts = (
        differs(smooth[0][part], smooth[1][part], slow, noise) for part in (slice(None), slice(half), slice(half, None))
    )
    wrong = [bad and all(p[k] is not False for p in parts) for k, bad in enumerate(whole)]
    about = 1 if wrong[1] and not wrong[0] else 0
    errors = smooth[0] - smooth[1]
    worst = int(np.argmax(np.linalg.norm(errors[:, 2:] if about else errors[:, :2], axis=1)))
    return Compared(smooth[0][worst], smooth[1][worst], any(wrong), any(each is not None for each in whole), about)


def differs(moved: Array, measured: Array, slow: tuple[float, float], noise: tuple[float, float]) -> list[bool | None]:
    """Whether velocities, and the yaw rate, differ from the positions; None where the boat moves too slowly for a verdict."""
    verdicts: list[bool | None] = []
    for part, least, blurred in zip((slice(0, 2), slice(2, 3)), slow, noise, strict=True):
        fastest = max(rms(each[:, part]) for each in (moved, measured))
        bound = ERROR_SHARE * fastest + least + BLURRED * blurred
        known = fastest > 2.0 * least + BLURRED * blurred
        verdicts.append(rms((moved - measured)[:, part]) > bound if known else None)
    return verdicts


def rms(vectors: Array) -> float:
    """Root mean square of the lengths of vectors, (m, k)."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def commanded_side(connection: Connection) -> int:
    """The sign of the mean of what has been commanded ahead or astern; 0 if nothing has."""
    command = connection.of("output", "command", "applied")
    columns = {} if command is None else command.columns
    ahead = columns.get("u", columns.get("force", np.zeros(1)))
    return int(np.sign(ahead.mean()))


def judge_drift_angle(samples: Samples, moved: Array, measured: Array, fast: Array, side: int) -> Iterator[Finding]:
    """That a boat moves roughly where it heads, and by the velocities where it does by the positions."""
    if fast.sum() < LEAST_BLOCKS // 2:
        yield Finding(OK, "velocities", "velocities fit the turns of the heading")
        return
    psi = headings(samples)[: len(moved)][fast]
    ahead = (moved[fast, 0] + 1j * moved[fast, 1]) * np.exp(-1j * psi)
    angle = math.degrees(np.angle(ahead.mean()))
    if abs(angle) > LARGEST_DRIFT and abs(ahead.mean()) > STEADY * np.abs(ahead).mean():
        yield judge_direction(angle, off_course(ahead, psi), side)
    elif samples.motions[:, 3].any() and not samples.motions[:, 4].any():
        text = "v is 0 in all messages, as of wheels; a boat has sway, which controller.observer.enabled: true estimates"
        yield Finding(TODO, "velocities", text)
    elif abs(turned := angle_between(moved[fast], measured[fast])) > TURNED:
        text = (
            f"the velocities point {abs(turned):.0f} deg to {'port' if turned < 0.0 else 'starboard'} of the way of the positions"
        )
        cause = "a twist in the frame of the pose, a compass from magnetic north or turned, the course in place of the heading"
        correction = f"navsat_odom.heading_offset is larger by {math.radians(turned):.2f} then"
        yield Finding(TODO, "heading", f"{text}: {cause}? {correction}")
    else:
        yield Finding(OK, "velocities", f"they fit positions and heading, in m/s and rad/s; drift angle {angle:.0f} deg")


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


def off_course(ahead: Array, psi: Array) -> bool:
    """Whether a boat moves in another direction than it heads, in all and in each half of the data, and not by a current."""
    half = len(ahead) // 2
    for part in (slice(None), slice(half), slice(half, None)):
        mean = complex(ahead[part].mean())
        steady = abs(mean) > STEADY * float(np.abs(ahead[part]).mean())
        if not (steady and abs(math.degrees(np.angle(mean))) > LARGEST_DRIFT and abs(mean) > carried(psi)):
            return False
    return True


def angle_between(moved: Array, measured: Array) -> float:
    """The angle from the measured velocities to those of the positions, counter-clockwise, deg; 0 where it changes."""
    one, other = (each[:, 0] + 1j * each[:, 1] for each in (moved, measured))
    turns = one * other.conj()
    size = float(np.abs(turns).sum())
    return math.degrees(np.angle(turns.sum())) if abs(turns.sum()) > ALIKE * size > 0.0 else 0.0


# -- hypotheses -------------------------------------------------------------------------------------------------------


def in_degrees(samples: Samples, moved: Array, measured: Array, slow: float) -> bool:
    """Whether positions are latitude and longitude: they move a hundred-thousandth of the velocities."""
    speed, way = (float(np.median(np.linalg.norm(each[:, :2], axis=1))) for each in (measured, moved))
    ratio = way * METRES_PER_DEGREE / speed if speed > slow else 0.0
    return 0.3 < ratio < 3.0 and bool((np.abs(samples.motions[:, :2]) <= 360.0).all())


def mirrored_heading(samples: Samples, moved: Array, measured: Array, fast: Array) -> str | None:
    """What is wrong where course and heading turn in opposite directions: their sum is constant, and not their difference."""
    if fast.sum() < LEAST_BLOCKS:
        return None
    course, psi = np.arctan2(moved[fast, 1], moved[fast, 0]), headings(samples)[: len(moved)][fast]
    speed, half = np.linalg.norm(moved[fast, :2], axis=1), len(course) // 2
    for part in (slice(None), slice(half), slice(half, None)):
        spread, other = (1.0 - abs(np.exp(1j * (course + sign * psi)[part]).mean()) for sign in (1.0, -1.0))
        if other < LEAST_SPREAD or other < 3.0 * spread or spread > LARGEST_SPREAD:
            return None
        if abs((speed * np.exp(1j * (course + psi)))[part].mean()) < carried(psi[part]):
            return None
    total = np.exp(1j * (course + psi)).mean()
    if abs(np.angle(total * np.exp(-0.5j * math.pi))) < 0.6:
        agrees = float((moved[:, 2] * measured[:, 2]).sum()) > 0.0
        cause = "does the heading count clockwise from north (NED)"
        cause += ", or are positions x north and y east?" if agrees else "?"
    else:
        cause = "does it count clockwise (FRD)?"
    return f"course and heading turn in opposite directions: {cause} It must be x east, y north, heading counter-clockwise (ENU)"


def with_columns(motions: Array, factor: float = 1.0, u: float = 1.0, v: float = 1.0, r: float = 1.0) -> Array:
    """Motions with scaled velocities."""
    return np.asarray(motions * np.array([1.0, 1.0, 1.0, factor * u, factor * v, r]))


SPEEDS: dict[str, Callable[[Array], Array]] = {
    "is the twist in the frame of the pose? controller.odometry.twist_frame: parent is for that": along_hull,
    "are they in knots? They must be in m/s": lambda m: with_columns(m, KNOT),
    "are they in km/h? They must be in m/s": lambda m: with_columns(m, KM_PER_HOUR),
    "are they in miles per hour? They must be in m/s": lambda m: with_columns(m, MILE_PER_HOUR),
    "are they in feet per second? They must be in m/s": lambda m: with_columns(m, FOOT),
    "are the positions in mm? They must be in m": lambda m: with_columns(m, 1000.0),
    "are the positions in cm? They must be in m": lambda m: with_columns(m, 100.0),
    "are the positions in feet? They must be in m": lambda m: with_columns(m, 1.0 / FOOT),
    "is v positive to starboard (FRD)? It must be FLU, to port": lambda m: with_columns(m, v=-1.0),
    "is u positive astern? It must be FLU, ahead": lambda m: with_columns(m, u=-1.0),
    "are they reversed, or is the heading off by 180 deg? It must be FLU, ahead and to port": lambda m: with_columns(m, -1.0),
    "does the heading count from north? It must be rad from east": lambda m: m + np.array([0, 0, 0.5 * math.pi, 0, 0, 0]),
    "is the heading off by 90 deg? It must be rad from east": lambda m: m - np.array([0, 0, 0.5 * math.pi, 0, 0, 0]),
}
"""What may be wrong with u and v, and what undoes it."""

ALONG_HULL: dict[str, Callable[[Array], Array]] = {
    "are they along the hull already? controller.odometry.twist_frame: child is for that": lambda m: along_hull(m, back=True)
}
"""What may be wrong with u and v besides, where they are taken to be along x and y."""

TURNS = {
    "is the yaw rate in degrees per second? It must be rad/s": math.radians(1.0),
    "is the heading in degrees? It must be rad": math.degrees(1.0),
    "is the yaw rate positive to starboard (FRD)? It must be FLU, to port": -1.0,
}
"""What may be wrong with r, and the factor that undoes it."""


def named(samples: Samples, moved: Array, about: int, twist_frame: str = "child") -> str:
    """The hypothesis that fits best, with numbers; empty if none does."""
    part = slice(2, 3) if about else slice(0, 2)

    def misfit(motions: Array) -> float:
        return rms((moved - rates(Samples(samples.times, motions))[1])[:, part])

    motions = samples.motions
    speeds = SPEEDS | (ALONG_HULL if twist_frame == "parent" else {})
    tried = (
        {text: with_columns(motions, r=f) for text, f in TURNS.items()} if about else {t: f(motions) for t, f in speeds.items()}
    )
    errors = {text: misfit(each) for text, each in tried.items()}
    best = min(errors, key=lambda text: errors[text])
    if errors[best] > ERROR_SHARE * rms(moved[:, part]) or errors[best] > 0.5 * misfit(motions):
        return ""
    return f"the measured {'yaw rate' if about else 'velocities'} and the positions differ: {best}"
