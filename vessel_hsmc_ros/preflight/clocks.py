"""Rules for stamps: filled in, increasing, and of the clock of the nodes, which neither steps nor has another time zone."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.preflight.connection import Connection, Role, Topic

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
    step = clock_step(topic)
    return without_stamps(topic) or (stepped(topic, step) if step is not None and step.of_stamps else "")


def without_stamps(topic: Topic) -> str:
    """That a topic has stamps, but does not fill them in; empty if it does."""
    stamps = topic.columns.get("stamp")
    unfilled = stamps is not None and not stamps.any()
    return f"{topic.name} has no stamps (0): its publisher must fill in header.stamp" if unfilled else ""


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
    if text := without_stamps(topic):
        yield text
        return
    stamps = topic.columns["stamp"]
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
