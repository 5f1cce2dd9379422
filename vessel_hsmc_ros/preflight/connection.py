"""What a connection with a boat's stack is made of, live or from a bag, and its measured motion, as the rules judge them.

Stamps must be filled in, increase, and be of the clock of the nodes, which neither steps nor runs in another time zone.
"""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array

OK, TODO, WRONG = "ok", "todo", "wrong"
"""Levels of a finding: as it must be, not shown yet, or a mistake; the text of the last two has what to do."""


class Finding(NamedTuple):
    """A line of the page: its level, what it is about, and what was found."""

    level: str
    about: str
    text: str


class Endpoint(NamedTuple):
    """A publisher or a subscription: its node, message type, and quality of service."""

    node: str
    kind: str
    reliable: bool = True
    latched: bool = False


class Topic(NamedTuple):
    """A topic as it was observed."""

    name: str  # its full name
    # publishers, readers: its endpoints
    publishers: tuple[Endpoint, ...] = ()
    readers: tuple[Endpoint, ...] = ()
    received: Array = np.empty(0)  # times of receipt on the clock of the nodes, s, (n,)
    # what its messages contain, by names that all forms share: stamp, frame, child, x, y, psi, u, v, r, ... (n,)
    columns: Mapping[str, Array] = {}


EULER = "euler angles"  # the role of an IMU whose driver publishes roll, pitch and yaw in degrees in place of the quaternion


class Role(NamedTuple):
    """A topic that the connection needs."""

    name: str  # what it is: odometry, pose, twist, reference, command, fix, imu, ..
    topic: str  # its full name
    kinds: tuple[str, ...]  # the message types that it may have
    is_input: bool  # whether a node of this package reads it; else it writes it, and the stack reads it
    # frames, child_frames: those that it may have; empty for any
    frames: tuple[str, ...] = ()
    child_frames: tuple[str, ...] = ()
    timeout: float = 0.5  # time without a message from which on it counts as lost, s
    own: str = ""  # the name of the topic before remapping


class Autopilot(NamedTuple):
    """What an autopilot tells of its failsafes."""

    firmware: str = ""  # ArduPilot, PX4, or empty where none has told anything
    values: Mapping[str, float] = {}  # parameters by name
    system_id: int = 0  # the system as which this package commands
    silence: str = ""  # why it has told nothing, and what to do


class Connection(NamedTuple):
    """A connection as it was observed."""

    roles: tuple[Role, ...]  # what it needs
    topics: Mapping[str, Topic] = {}  # all topics by their full names
    twist_frame: str = "child"  # frame of the measured velocities: child, or parent
    length: float = 1.0  # of the ship, m
    # declared standard deviations of a sample of the position, m, and of the heading, rad
    noise: tuple[float, float] = (0.0, 0.0)
    # its declared surge and yaw inertia, kg and kg·m²; nan where they are not known
    inertias: tuple[float, float] = (np.nan, np.nan)
    future: float = 0.1  # time by which stamps may be ahead, s
    covariance_limit: float = np.inf  # largest variance of a position, m²
    is_live: bool = True  # whether nodes are running; a bag shows no subscriptions
    uses_observer: bool = False  # whether the controller estimates the velocities itself
    simulated: tuple[str, ...] = ()  # the nodes that keep to /clock
    events: tuple[str, ...] = ()  # kinds of the events of the nodes
    reasons: tuple[str, ...] = ()  # names of the reasons for which the controller has left the law
    autopilot: Autopilot | None = None  # None for a stack without one that this package reads
    statuses: Mapping[str, tuple[str, str]] = {}  # level and text of the nodes' diagnostics that are not OK, by node

    def topic(self, role: Role) -> Topic:
        """The topic of a role; an empty one if it does not exist."""
        return self.topics.get(role.topic, Topic(role.topic))

    def of(self, *names: str) -> Topic | None:
        """The topic of the first of some roles that has messages; None if none has."""
        found = {role.name: self.topic(role) for role in self.roles}
        return next((found[name] for name in names if name in found and len(found[name].received)), None)


LEAST_STEP, SIDE, BESIDE = 0.3, 5, 2.0
"""The least step of a clock that counts, s, and how many messages, and how long, before and after it show it."""

QUARTER, ZONES, GPS, YEAR = 900.0, (1800.0, 50_400.0), 18.0, 3e7
"""Time zones are multiples of a quarter of an hour, up to 14 h; by how much GPS time is ahead of UTC; a year; s."""

SYNCHRONISE = "synchronise the clocks (chrony, GPS), or let the driver stamp at receipt"


class Step(NamedTuple):
    """A step of a clock: its size, s, and whether it was that of the stamps, not the clock here."""

    size: float
    of_stamps: bool


def clock_step(topic: Topic) -> Step | None:
    """The step by which the stamps of a topic and the times of receipt part for good; None without one.

    Messages that come late, from a network that stops or to a busy computer, are none: their ages change all the time.
    """
    stamps = topic.columns.get("stamp")
    if stamps is None or len(stamps) < 2 * SIDE or not stamps.all():
        return None
    ages = np.asarray(topic.received - stamps)
    at = SIDE + int(np.argmax(np.abs(np.diff(ages))[SIDE - 1 : len(ages) - SIDE]))
    size = float(np.median(ages[at:]) - np.median(ages[:at]))
    spread = max(float(np.ptp(np.quantile(side, (0.05, 0.95)))) for side in (ages[:at], ages[at:]))
    beside = min(topic.received[at - 1] - topic.received[0], topic.received[-1] - topic.received[at])
    if abs(size) < max(LEAST_STEP, 4.0 * spread) or beside < BESIDE or abs(ages[at] - ages[at - 1]) < 0.5 * abs(size):
        return None
    steps = [abs(float(times[at] - times[at - 1]) - float(np.median(np.diff(times)))) for times in (stamps, topic.received)]
    of_stamps = steps[0] > steps[1]
    return Step(-size if of_stamps else size, of_stamps)


def times_of(topic: Topic) -> Array:
    """The times of a topic's messages on the clock here, s: by their stamps, which have no jitter, where these increase steadily.

    The median age is added, so that neither an offset of the clocks nor the way of the messages separates cause and effect.
    """
    stamps = topic.columns.get("stamp")
    usable = stamps is not None and len(stamps) > 1 and bool((np.diff(stamps) > 0.0).all()) and clock_step(topic) is None
    if stamps is None or not usable:
        return np.asarray(topic.received, dtype=float)
    return np.asarray(stamps + np.median(topic.received - stamps), dtype=float)


def unusable(topic: Topic) -> str:
    """Why the stamps of a topic are no times, whatever the clock here: not filled in, or stepped; empty if they are."""
    stamps = topic.columns.get("stamp")
    if stamps is not None and not stamps.any():
        return f"{topic.name} has no stamps (0): its publisher must fill in header.stamp"
    step = clock_step(topic)
    return stepped(topic, step) if step is not None and step.of_stamps else ""


def stepped(topic: Topic, step: Step) -> str:
    """What a step of a clock is, and what to do."""
    whose = f"the stamps of {topic.name} have" if step.of_stamps else "the clock here has"
    return f"{whose} stepped by {step.size:.3g} s: set the clock before the nodes start, and let it be slewed from then on"


def set_back(stamps: Array) -> float:
    """The longest time that stamps in the order of recording cover twice, by steps back of some seconds, s.

    A few late messages are no step, and files that are read in another order than they were written cover other times.
    """
    edges = np.concatenate([[0], np.flatnonzero(np.diff(stamps) < -BESIDE) + 1])
    first, last = np.minimum.reduceat(stamps, edges), np.maximum.reduceat(stamps, edges)
    order = np.argsort(first, kind="stable")
    twice = np.maximum.accumulate(last[order])[:-1] - first[order][1:]
    return float(max(twice.max(initial=0.0), 0.0))


def clocks_differ(one: Topic, other: Topic, limit: float) -> str:
    """That the stamps of two topics are of two clocks, by their times of receipt; empty if they differ by a limit, s, or less."""
    ages = [float(np.median(topic.received - topic.columns["stamp"])) for topic in (one, other)]
    ahead = ages[0] - ages[1]
    if abs(ahead) <= limit:
        return ""
    word = "ahead of" if ahead > 0.0 else "behind"
    return f"stamps of {other.name} are {abs(ahead):.6g} s {word} those of {one.name} at receipt: {offset_cause(ahead)}"


def judge_stamps(connection: Connection, role: Role, topic: Topic) -> Iterator[str]:
    """That stamps are filled in, increase, and are of the clock of the nodes."""
    if "stamp" not in topic.columns:
        return
    stamps = topic.columns["stamp"]
    if not stamps.any():
        yield f"{topic.name} has no stamps (0): its publisher must fill in header.stamp"
        return
    if (step := clock_step(topic)) is not None:
        yield stepped(topic, step)
    steps = np.diff(stamps)
    if (steps < 0.0).mean() > 0.01:
        yield f"{topic.name} has stamps that go back, {int((steps < 0.0).sum())} of {len(steps)}: two sources on one topic?"
    elif (steps == 0.0).mean() > 0.2:
        yield f"{topic.name} repeats its stamps, {int((steps == 0.0).sum())} of {len(steps)}: only the first of each counts"
    age = float(np.median(topic.received - stamps))
    if step is None and age > role.timeout:
        yield f"stamps of {topic.name} are {age:.6g} s old, above the time-out of {role.timeout:g} s: {offset_cause(-age)}"
    elif step is None and age < -connection.future:
        yield f"stamps of {topic.name} are {-age:.6g} s ahead of the clock here: {offset_cause(-age)}"


def offset_cause(ahead: float) -> str:
    """What an offset of stamps looks like, and what to do; the offset in s, positive where they are ahead."""
    size = abs(ahead)
    if size > YEAR:
        return (
            "are they counted from a start, or of a simulation (/clock, use_sim_time)? Let the driver stamp by the system's clock"
        )
    if ZONES[0] - 60.0 < size < ZONES[1] + 60.0 and abs(size - QUARTER * round(size / QUARTER)) < 60.0:
        return f"are they in local time? Stamps are UTC; or {SYNCHRONISE}"
    if abs(ahead - GPS) < 0.9:
        return f"are they in GPS time, which is {GPS:g} s ahead of UTC? Or {SYNCHRONISE}"
    return SYNCHRONISE


BLOCK = 1.0  # length of the blocks whose means are compared, s
GAP = 10.0  # time without odometry after which a motion is another one, s


class Samples(NamedTuple):
    """Measured motions: times (n,), s, and x, y, psi, u, v, r (n, 6)."""

    times: Array
    motions: Array


def motions_of(connection: Connection) -> Samples | None:
    """The measured motion of a connection, with velocities along the hull: its longest part without a gap; None without one."""
    state, twist = connection.of("odometry", "pose"), connection.of("twist")
    if state is None or "x" not in state.columns or len(state.received) < 3:
        return None
    times = times_of(state)
    keep = longest_part(times)
    columns = [state.columns[name] for name in ("x", "y", "psi")]
    source = twist if twist is not None else state
    if "u" not in source.columns:
        return None
    at = times if source is state else times_of(source)
    columns += [np.interp(times, at, source.columns[name]) if source is not state else source.columns[name] for name in "uvr"]
    motions = np.column_stack(columns).astype(float)[keep]
    if len(motions) < 3 or not np.isfinite(motions).all():
        return None
    if connection.twist_frame == "parent":
        motions = along_hull(motions)
    return Samples(times[keep], motions)


def longest_part(times: Array) -> Array:
    """Where the samples are of the longest part without a gap or a step of the clock, in the order of their times."""
    part = np.cumsum(np.abs(np.diff(times, prepend=times[0])) > GAP)
    inside = part == np.bincount(part).argmax()
    latest = np.maximum.accumulate(np.where(inside, times, -math.inf))
    return np.asarray(inside & (times > np.concatenate(([-math.inf], latest[:-1]))))


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


def without_jumps(samples: Samples, least: float, jitter: float) -> tuple[Samples, Array]:
    """Samples whose positions do not jump, and the sizes of the jumps, m.

    A step of the positions is a jump where it differs from that of the velocities by some length and by much more than usual.
    Positions that are held, as between the fixes of a receiver that is slower than the odometry, have no usual difference.
    `least`: the least jump, m. `jitter`: how many times the median difference a jump is.
    """
    t, motions = samples
    dt = np.diff(t)
    c, s = np.cos(motions[1:, 2]), np.sin(motions[1:, 2])
    u, v = motions[1:, 3], motions[1:, 4]
    steps = np.diff(motions[:, :2], axis=0)
    error = steps - np.column_stack((c * u - s * v, s * u + c * v)) * dt[:, None]
    size = np.linalg.norm(error, axis=1)
    new = steps.any(axis=1)
    usual = float(np.median(size[new])) if new.any() else 0.0
    jumps = (size > least + jitter * usual) & (dt < 3.0 * float(np.median(dt)))
    smooth = motions.copy()
    smooth[1:, :2] -= np.cumsum(error * jumps[:, None], axis=0)
    return Samples(t, smooth), size[jumps]


def noises(samples: Samples, declared: tuple[float, float]) -> tuple[float, float]:
    """Standard deviation of a sample of the position, m, and of the heading, rad: as declared or, if that is larger, as measured.

    White noise of variance V makes third differences of 20·V, in which a motion hardly counts; the median does without jumps.
    """
    columns = *samples.motions[:, :2].T, np.unwrap(samples.motions[:, 2])
    found = [
        float(np.median(np.abs(np.diff(each, 3)))) / (0.6745 * math.sqrt(20.0)) if len(each) > 3 else 0.0 for each in columns
    ]
    return max(found[0], found[1], declared[0]), max(found[2], declared[1])


def sample_rate(samples: Samples) -> float:
    """Rate of the samples with a new position, Hz; a receiver may be slower than the odometry."""
    t, motions = samples
    return float(max(np.diff(motions[:, :2], axis=0).any(axis=1).sum(), 1)) / float(t[-1] - t[0])


CURRENT = 1.5  # speed with which wind and current may carry a boat, m/s


def carried(psi: Array) -> float:
    """The mean velocity in its own frame, m/s, that wind and current may give a boat with some headings: 0 in full circles."""
    return CURRENT * float(abs(np.exp(1j * psi).mean()))
