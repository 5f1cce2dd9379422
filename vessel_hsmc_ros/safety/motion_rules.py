"""Rules for the measured motion: do velocities, heading and positions fit, and if not, in which unit or frame would they?

The rates of a motion follow from its positions and from its velocities. Each mistake is a hypothesis that undoes it. Where the
velocities contradict the positions, the one with which they fit best is named.
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.safety.connection import OK, TODO, WRONG, Connection, Finding, Topic
from vessel_hsmc_ros.safety.monitors import SLOW_SPEED, Compared, explained
from vessel_hsmc_ros.safety.stamp_rules import times_of

BLOCK = 1.0
"""Length of the blocks whose means are compared, s."""


class Samples(NamedTuple):
    """Measured motions: times (n,), s, and x, y, psi, u, v, r (n, 6)."""

    times: Array
    motions: Array


def motions_of(connection: Connection) -> Samples | None:
    """The measured motion of a connection, with velocities along the hull; None without one."""
    state, twist = connection.of("odometry", "pose"), connection.of("twist")
    if state is None or "x" not in state.columns or len(state.received) < 3:
        return None
    times = times_of(state)
    keep = np.concatenate(([True], np.diff(times) > 0.0))
    columns = [state.columns[name] for name in ("x", "y", "psi")]
    source = twist if twist is not None else state
    if "u" not in source.columns:
        return None
    at = times if source is state else times_of(source)
    columns += [np.interp(times, at, source.columns[name]) if source is not state else source.columns[name] for name in "uvr"]
    motions = np.column_stack(columns).astype(float)[keep]
    if not np.isfinite(motions).all():
        return None
    if connection.twist_frame == "parent":
        motions = along_hull(motions)
    return Samples(times[keep], motions)


def along_hull(motions: Array, back: bool = False) -> Array:
    """Motions whose u and v are along x and y, with those along the hull; the other way round if `back`."""
    c, s = np.cos(motions[:, 2]), np.sin(motions[:, 2]) * (-1.0 if back else 1.0)
    u, v = motions[:, 3], motions[:, 4]
    return np.column_stack((motions[:, :3], c * u + s * v, -s * u + c * v, motions[:, 5]))


def rates(samples: Samples) -> tuple[Array, Array]:
    """Velocities of x, y and psi block by block: by the positions, and as measured; each (m, 3)."""
    t, motions = samples
    c, s = np.cos(motions[:, 2]), np.sin(motions[:, 2])
    u, v, r = motions[:, 3:].T
    world = np.column_stack((c * u - s * v, s * u + c * v, r))
    steps = 0.5 * (world[1:] + world[:-1]) * np.diff(t)[:, None]
    integral = np.vstack((np.zeros(3), np.cumsum(steps, axis=0)))
    place = np.column_stack((motions[:, :2], np.unwrap(motions[:, 2])))
    # Means over blocks are even with unequal intervals if the times are averaged as well.
    each = means(t, np.column_stack((t, place, integral)))
    changes = np.diff(each, axis=0) / np.diff(each[:, :1], axis=0)
    return changes[:, 1:4], changes[:, 4:]


def means(times: Array, columns: Array, width: float = BLOCK) -> Array:
    """Means of columns over blocks of a width, s, that have samples."""
    block = ((times - times[0]) / width).astype(int)
    starts = np.flatnonzero(np.concatenate(([True], np.diff(block) > 0)))
    counts = np.diff(np.append(starts, len(times)))
    return np.asarray(np.add.reduceat(columns, starts, axis=0) / counts[:, None])


def headings(samples: Samples) -> Array:
    """Headings between the blocks of `rates`."""
    each = means(samples.times, np.unwrap(samples.motions[:, 2])[:, None])[:, 0]
    return np.asarray(0.5 * (each[1:] + each[:-1]))


def repetition(samples: Samples, command: Topic | None) -> float:
    """The longest time, s, for which a boat has one and the same motion although its velocities or the commands are not 0."""
    t, motions = samples
    changes = np.flatnonzero((np.diff(motions, axis=0) != 0.0).any(axis=1))
    first, last = np.concatenate(([0], changes + 1)), np.concatenate((changes, [len(t) - 1]))
    longest = int(np.argmax(t[last] - t[first]))
    begin, end = float(t[first[longest]]), float(t[last[longest]])
    commanded = command is not None and any(
        values[(command.received > begin) & (command.received < end)].any()
        for name, values in command.columns.items()
        if name in ("force", "moment", "u", "r")
    )
    return end - begin if commanded or motions[first[longest], 3:].any() else 0.0


def without_jumps(samples: Samples, least: float, jitter: float) -> tuple[Samples, Array]:
    """Samples whose positions do not jump, and the sizes of the jumps, m.

    A step of the positions is a jump where it differs from that of the velocities by some length and by much more than usual.

    Args:
        samples: As measured.
        least: The least jump, m.
        jitter: How many times the median difference a jump is.
    """
    t, motions = samples
    dt = np.diff(t)
    c, s = np.cos(motions[1:, 2]), np.sin(motions[1:, 2])
    u, v = motions[1:, 3], motions[1:, 4]
    error = np.diff(motions[:, :2], axis=0) - np.column_stack((c * u - s * v, s * u + c * v)) * dt[:, None]
    size = np.linalg.norm(error, axis=1)
    jumps = (size > least + jitter * float(np.median(size))) & (dt < 3.0 * float(np.median(dt)))
    smooth = motions.copy()
    smooth[1:, :2] -= np.cumsum(error * jumps[:, None], axis=0)
    return Samples(t, smooth), size[jumps]


LEAST_BLOCKS = 6

ERROR_SHARE = 0.3
"""Share of the velocity above which an error counts; knots are twice m/s."""

LEAST_SPREAD = 0.005
"""Circular variance of the heading from which on its sense can be seen: 0.1 rad."""

LONGEST_REPETITION = 2.0
"""Time for which a moving boat may have one and the same motion, s: that of a slow receiver."""

JUMP, JITTER = 0.3, 20.0
"""A position jumps where it moves on by this share of the ship's length and so many times the usual error of a step."""

TURNED, ALIKE = 10.0, 0.95
"""Angle between velocities and positions that counts, deg, and the resultant above which it is always the same."""

KNOT, KM_PER_HOUR, MILE_PER_HOUR, FOOT = 1852.0 / 3600.0, 1.0 / 3.6, 0.44704, 0.3048

METRES_PER_DEGREE = 111_000.0


def judge_motion(connection: Connection) -> Iterator[Finding]:
    """Findings on velocities, units, heading and their frames."""
    samples = motions_of(connection)
    if samples is None:
        return
    if (still := repetition(samples, connection.of("output", "command"))) > LONGEST_REPETITION:
        yield judge_repetition(samples, still)
        return
    samples, jumps = without_jumps(samples, JUMP * connection.length, JITTER)
    if len(jumps):
        text = f"they jump, {len(jumps)} times, by {jumps.max():.3g} m at most, as those that are corrected now and then"
        yield Finding(WRONG, "positions", f"{text}: take the continuous odometry of the filter, in odom, not in map")
    slow = SLOW_SPEED * math.sqrt(GRAVITY * connection.length)
    moved, measured = rates(samples)
    if len(moved) < LEAST_BLOCKS - 1:
        yield Finding(TODO, "velocities", f"too few samples: it takes {LEAST_BLOCKS * BLOCK:g} s of state")
        return
    speeds = np.linalg.norm(moved[:, :2], axis=1)
    if in_degrees(samples, moved, measured, slow):
        yield Finding(WRONG, "positions", "they look like latitude and longitude: it takes m in a plane, by navsat_odom_node")
        return
    if (turned := mirrored_heading(samples, moved, measured, slow)) is not None:
        yield Finding(WRONG, "heading", turned)
        return
    found = contradiction(moved, measured, (slow, slow / connection.length))
    if not found.known:
        yield Finding(TODO, "velocities", f"the boat moves at {np.median(speeds):.2g} m/s: check again while it sails turns")
    elif found.wrong and not (connection.uses_observer and not samples.motions[:, 3:].any()):
        yield Finding(WRONG, "velocities", named(samples, moved, found.about, connection.twist_frame) or explained(found))
    else:
        yield from judge_drift_angle(samples, moved, measured, slow)


def judge_repetition(samples: Samples, still: float) -> Finding:
    """What it means that all numbers are the same for a time, s."""
    if samples.motions[:, 3:].any():
        return Finding(
            WRONG, "velocities", f"the same numbers for {still:.3g} s under way: does the driver repeat its last message?"
        )
    text = f"the boat has not moved at all for {still:.3g} s under a command: does no command reach it, is it armed"
    return Finding(TODO, "velocities", f"{text}, or does the driver repeat its last message?")


def contradiction(moved: Array, measured: Array, slow: tuple[float, float]) -> Compared:
    """How the velocities differ from the positions, over pairs of blocks, in which the noise of the positions partly cancels.

    Args:
        moved, measured: Rates of x, y and psi by the positions and by the velocities, (m, 3).
        slow: Speed and yaw rate below which nothing is concluded, m/s and rad/s.
    """
    smooth = [0.5 * (each[1:] + each[:-1]) for each in (moved, measured)]
    errors = smooth[0] - smooth[1]
    verdicts = []
    for part, least in zip((slice(0, 2), slice(2, 3)), slow, strict=True):
        fastest = max(rms(each[:, part]) for each in smooth)
        verdicts.append((fastest > 2.0 * least, rms(errors[:, part]) > ERROR_SHARE * fastest + least))
    wrong = [known and bad for known, bad in verdicts]
    about = wrong.index(True) if any(wrong) else 0
    worst = int(np.argmax(np.linalg.norm(errors[:, 2:] if about else errors[:, :2], axis=1)))
    return Compared(smooth[0][worst], smooth[1][worst], any(wrong), any(known for known, _ in verdicts), about)


def rms(vectors: Array) -> float:
    """Root mean square of the lengths of vectors, (m, k)."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def judge_drift_angle(samples: Samples, moved: Array, measured: Array, slow: float) -> Iterator[Finding]:
    """That a boat moves roughly where it heads, and by the velocities where it does by the positions."""
    fast = np.linalg.norm(moved[:, :2], axis=1) > 2.0 * slow
    if fast.sum() < LEAST_BLOCKS // 2:
        yield Finding(OK, "velocities", "velocities fit the turns of the heading")
        return
    ahead = np.exp(1j * (np.arctan2(moved[:, 1], moved[:, 0]) - headings(samples)[: len(moved)]))[fast].mean()
    angle = math.degrees(np.angle(ahead))
    if abs(ahead) > 0.8 and abs(angle) > 60.0:
        cause = (
            "does the heading count from north?"
            if abs(abs(angle) - 90.0) < 30.0
            else "is it going astern, or the IMU mounted backwards?"
        )
        offset = f"it takes rad from east, counter-clockwise (navsat_odom.heading_offset = {math.radians(angle):.2f} corrects it)"
        yield Finding(WRONG, "heading", f"the boat moves {angle:.0f} deg to port of its heading: {cause} {offset}")
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


def mirrored_heading(samples: Samples, moved: Array, measured: Array, slow: float) -> str | None:
    """What is wrong where course and heading turn in opposite directions: their sum is constant, and not their difference."""
    fast = np.linalg.norm(moved[:, :2], axis=1) > 2.0 * slow
    if fast.sum() < LEAST_BLOCKS // 2:
        return None
    course, psi = np.arctan2(moved[fast, 1], moved[fast, 0]), headings(samples)[: len(moved)][fast]
    total, difference = (np.exp(1j * (course + sign * psi)).mean() for sign in (1.0, -1.0))
    spread, other = 1.0 - abs(total), 1.0 - abs(difference)
    if other < LEAST_SPREAD or other < 3.0 * spread:
        return None
    if abs(np.angle(total * np.exp(-0.5j * math.pi))) < 0.6:
        agrees = float((moved[:, 2] * measured[:, 2]).sum()) > 0.0
        cause = "does the heading count clockwise from north (NED)"
        cause += ", or are positions x north and y east?" if agrees else "?"
    else:
        cause = "does it count clockwise (FRD)?"
    return f"course and heading turn in opposite directions: {cause} It takes x east, y north, heading counter-clockwise (ENU)"


def with_columns(motions: Array, factor: float = 1.0, u: float = 1.0, v: float = 1.0, r: float = 1.0) -> Array:
    """Motions with scaled velocities."""
    return np.asarray(motions * np.array([1.0, 1.0, 1.0, factor * u, factor * v, r]))


SPEEDS: dict[str, Callable[[Array], Array]] = {
    "is the twist in the frame of the pose? controller.odometry.twist_frame: parent takes that": along_hull,
    "are they in knots? It takes m/s": lambda m: with_columns(m, KNOT),
    "are they in km/h? It takes m/s": lambda m: with_columns(m, KM_PER_HOUR),
    "are they in miles per hour? It takes m/s": lambda m: with_columns(m, MILE_PER_HOUR),
    "are they in feet per second? It takes m/s": lambda m: with_columns(m, FOOT),
    "are the positions in mm? It takes m": lambda m: with_columns(m, 1000.0),
    "are the positions in cm? It takes m": lambda m: with_columns(m, 100.0),
    "are the positions in feet? It takes m": lambda m: with_columns(m, 1.0 / FOOT),
    "is v positive to starboard (FRD)? It takes FLU, to port": lambda m: with_columns(m, v=-1.0),
    "is u positive astern? It takes FLU, ahead": lambda m: with_columns(m, u=-1.0),
    "are they reversed, or is the heading off by 180 deg? It takes FLU, ahead and to port": lambda m: with_columns(m, -1.0),
    "does the heading count from north? It takes rad from east": lambda m: m + np.array([0, 0, 0.5 * math.pi, 0, 0, 0]),
    "is the heading off by 90 deg? It takes rad from east": lambda m: m - np.array([0, 0, 0.5 * math.pi, 0, 0, 0]),
}
"""What may be wrong with u and v, and what undoes it."""

ALONG_HULL: dict[str, Callable[[Array], Array]] = {
    "are they along the hull already? controller.odometry.twist_frame: child takes that": lambda m: along_hull(m, back=True)
}
"""What may be wrong with u and v besides, where they are taken to be along x and y."""

TURNS = {
    "is the yaw rate in degrees per second? It takes rad/s": math.radians(1.0),
    "is the heading in degrees? It takes rad": math.degrees(1.0),
    "is the yaw rate positive to starboard (FRD)? It takes FLU, to port": -1.0,
}
"""What may be wrong with r, and the factor that undoes it."""


def named(samples: Samples, moved: Array, about: int, twist_frame: str = "child") -> str:
    """The hypothesis that fits best, with numbers; empty if none does.

    Args:
        samples: Measured motions.
        moved: Rates of x, y and psi by the positions.
        about: 0 for the velocity, 1 for the yaw rate.
        twist_frame: Frame of the velocities as declared: child, or parent.
    """
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
