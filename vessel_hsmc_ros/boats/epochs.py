"""Pairs the messages of two sources that measure at the same instants, in whichever order and at whatever rate they come."""

from collections import deque
from itertools import pairwise
from statistics import median_low
from typing import Generic, TypeVar

from vessel_hsmc_ros.core.timing import NANOSECONDS

T = TypeVar("T")

LARGEST_DIFFERENCE = NANOSECONDS // 10
"""Largest difference of two stamps of one epoch, ns: drivers that stamp on receipt have two for it."""

INTERVALS = 8  # intervals whose median is the time between two epochs


class Epochs(Generic[T]):
    """The messages of two sources that wait for their partner.

    Two messages are of one epoch where their stamps differ by less than LARGEST_DIFFERENCE and by less than half of the time
    between two epochs of the faster source: neighbouring epochs are never paired. Before that time is known, stamps must be
    equal. `window`: time for which a message waits, ns.
    """

    def __init__(self, window: int) -> None:
        self._window = window
        self._forget()

    def _forget(self) -> None:
        self._waiting: tuple[deque[tuple[int, T]], ...] = (deque(), deque())
        self._stamps: tuple[deque[int], ...] = (deque(maxlen=INTERVALS + 1), deque(maxlen=INTERVALS + 1))
        self._paired: int | None = None

    @property
    def difference(self) -> int:
        """The difference of two stamps from which on they are of two epochs, ns."""
        intervals = [median_low([b - a for a, b in pairwise(stamps)]) for stamps in self._stamps if len(stamps) > 1]
        return min(LARGEST_DIFFERENCE, (min(intervals) + 1) // 2) if intervals else 1

    def take(self, source: int, stamp: int, message: T) -> tuple[T, T] | None:
        """Take a message; returns the pair that it completes, that of source 0 first.

        `source`: 0 or 1. `stamp`: of the message, ns. A repeated or earlier one is left out, but for a clock that was set back.
        """
        own = self._stamps[source]
        if own and stamp < own[-1] - self._window:
            self._forget()
            own = self._stamps[source]
        if own and stamp <= own[-1]:
            return None
        own.append(stamp)
        self._paired = stamp if self._paired is None else self._paired
        partners = self._waiting[1 - source]
        near = min(partners, key=lambda entry: abs(entry[0] - stamp), default=None)
        if near is None or abs(near[0] - stamp) >= self.difference:
            self._wait(source, stamp, message)
            return None
        while partners.popleft()[0] < near[0]:
            pass
        self._waiting[source].clear()
        self._paired = stamp
        return (message, near[1]) if source == 0 else (near[1], message)

    def _wait(self, source: int, stamp: int, message: T) -> None:
        waiting = self._waiting[source]
        waiting.append((stamp, message))
        while waiting[0][0] < stamp - self._window:
            waiting.popleft()

    def is_single(self, stamp: int) -> bool:
        """Whether there has been no pair for as long as a message waits, at a time, ns."""
        return self._paired is not None and stamp - self._paired > self._window
